// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/turns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/version.hpp"
#include "calib/fit/src/turn_unknowns.hpp"
#include "calib/fit/src/turn_weighing.hpp"
#include "calib/record/calibration_warning.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/gauss_newton.hpp"
#include "core/formatted.hpp"
#include "kernels/turn_integration.hpp"

namespace axiscal {
namespace {

constexpr int most_turn_rounds = 50;
constexpr double most_revolutions_by_hand = 20.0;  // limit for one turn from rest to rest

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

// All given turns. Their readings minus the bias are packed for integration.
class TurnSet {
 public:
  TurnSet(std::span<const GyroscopeTurn> turns, const Eigen::Vector3d& bias)
      : turns_(turns), packed_(samples_of(turns), {bias.x(), bias.y(), bias.z()}) {
    for (const GyroscopeTurn& turn : turns) {
      earth_.emplace_back(
          rotation_by(-turn.earth_rate_in_sensor * (turn.time_s.back() - turn.time_s.front())));
    }
  }

  struct State {
    Eigen::VectorXd residuals;  // 3 entries for each turn
    // 3 n x 12: derivatives with respect to B (row by row) and to the bias
    Eigen::MatrixXd jacobian;
    std::vector<Eigen::Matrix3d> rotations;  // R(T) of each turn, relative to the Earth
    [[nodiscard]] double cost() const { return residuals.squaredNorm(); }
  };

  [[nodiscard]] State at(const Eigen::Matrix3d& B) const {
    const std::vector<IntegratedTurn> turns = integrated(B);
    const auto n = static_cast<Eigen::Index>(turns_.size());
    State state{.residuals = Eigen::VectorXd(3 * n),
                .jacobian = Eigen::MatrixXd(3 * n, 12),
                .rotations = {}};
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto t = static_cast<std::size_t>(i);
      const GyroscopeTurn& turn = turns_[t];
      const Eigen::Matrix3d& R = state.rotations.emplace_back(earth_[t] * rotation_of(turns[t]));
      // derivative of the rotation vector of R with respect to each unknown
      Eigen::Matrix<double, 3, 12> turned;
      for (Eigen::Index row = 0; row < 3; ++row) {
        for (Eigen::Index pq = 0; pq < 9; ++pq) {
          turned(row, pq) =
              turns[t].sensitivity[static_cast<std::size_t>(row)][static_cast<std::size_t>(pq)];
        }
        for (Eigen::Index column = 0; column < 3; ++column) {
          turned(row, 9 + column) = -turns[t].rotation_integral[static_cast<std::size_t>(row)]
                                                               [static_cast<std::size_t>(column)];
        }
      }
      turned.rightCols<3>() = (turned.rightCols<3>() * B).eval();
      turned = (earth_[t] * turned).eval();
      if (turn.rotation_before_from_after) {
        state.residuals.segment<3>(3 * i) =
            rotation_vector_of(*turn.rotation_before_from_after * R.transpose());
        state.jacobian.middleRows<3>(3 * i) = -turned;
      } else {
        const Eigen::Vector3d before = turn.up_before.normalized();
        const Eigen::Vector3d carried = R * turn.up_after.normalized();
        state.residuals.segment<3>(3 * i) = before - carried;
        state.jacobian.middleRows<3>(3 * i) = cross_matrix(carried) * turned;
      }
    }
    return state;
  }

 private:
  [[nodiscard]] std::vector<IntegratedTurn> integrated(const Eigen::Matrix3d& B) const {
    const RowMajor3 rows = B;
    return packed_.integrate(std::span<const double, 9>(rows.data(), 9));
  }

  static Eigen::Matrix3d rotation_of(const IntegratedTurn& turn) {
    return Eigen::Quaterniond(turn.attitude[0], turn.attitude[1], turn.attitude[2],
                              turn.attitude[3])
        .normalized()
        .toRotationMatrix();
  }

  static std::vector<TurnSamples> samples_of(std::span<const GyroscopeTurn> turns) {
    std::vector<TurnSamples> samples;
    for (const GyroscopeTurn& turn : turns) {
      samples.push_back({.rate = turn.readings, .time_s = turn.time_s});
    }
    return samples;
  }

  std::span<const GyroscopeTurn> turns_;
  PackedTurns packed_;
  std::vector<Eigen::Matrix3d> earth_;  // the Earth's rotation during the turn
};

// The state of the search: B (the inverse of the sensitivity), the bias, and the residuals.
struct Candidate {
  Eigen::Matrix3d B = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  std::shared_ptr<const TurnSet> set;  // readings minus this bias
  TurnSet::State state;
};

// The problem for gauss_newton(). The unknowns are B, row by row, and the bias if it is fitted.
class TurnProblem {
 public:
  using State = Candidate;
  using Linear = Linearised;

  TurnProblem(std::span<const GyroscopeTurn> turns, bool fit_bias)
      : turns_(turns), fit_bias_(fit_bias) {}

  [[nodiscard]] Candidate at(const Eigen::Matrix3d& B, const Eigen::Vector3d& bias) const {
    return at(B, bias, std::make_shared<const TurnSet>(turns_, bias));
  }
  void linearise(const Candidate& at, Linear& linear) const {
    linear.residuals = at.state.residuals;
    linear.jacobian = at.state.jacobian.leftCols(fit_bias_ ? 12 : 9);
  }
  [[nodiscard]] Candidate moved(const Candidate& from, const Eigen::VectorXd& step) const {
    const Eigen::Matrix3d B = from.B + Eigen::Map<const RowMajor3>(step.data());
    return fit_bias_ ? at(B, from.bias + step.tail<3>()) : at(B, from.bias, from.set);
  }
  [[nodiscard]] static double cost(const Candidate& at, const Linear& /*before*/) {
    return at.state.cost();
  }
  [[nodiscard]] double length(const Candidate& at,
                              const Eigen::VectorXd& step,
                              const Linear& /*there*/) const {
    return step.head<9>().norm() / at.B.norm() + (fit_bias_ ? (at.B * step.tail<3>()).norm() : 0.0);
  }

 private:
  [[nodiscard]] static Candidate at(const Eigen::Matrix3d& B,
                                    const Eigen::Vector3d& bias,
                                    std::shared_ptr<const TurnSet> set) {
    TurnSet::State state = set->at(B);
    return {.B = B, .bias = bias, .set = std::move(set), .state = std::move(state)};
  }

  std::span<const GyroscopeTurn> turns_;
  bool fit_bias_;
};

// Returns the usual scales of gyroscopes [rad/s per unit].
std::vector<double> usual_scales() {
  std::vector<double> scales = {1.0, rad_per_deg, 1e-3, 1e-3 * rad_per_deg};
  for (const double counts_per_deg_s :
       {131.072, 65.536, 32.768, 16.384, 14.375, 114.285714, 57.142857, 28.571429, 14.285714}) {
    scales.push_back(rad_per_deg / counts_per_deg_s);
  }
  return scales;
}

std::vector<double> all_scales() {
  std::vector<double> scales;
  for (double scale = 1e-6; scale < 2.0; scale *= 1.06) {
    scales.push_back(scale);
  }
  return scales;
}

// Limit of the rms of the attitude errors. Calibration errors do not explain a larger rms.
constexpr double good_rms_rad = 0.15;

double rms_of(double cost, std::size_t turns) {
  return std::sqrt(cost / static_cast<double>(turns));
}

Eigen::Matrix3d find_start(std::span<const GyroscopeTurn> turns,
                           const Eigen::Vector3d& bias,
                           const TurnFitOptions& options) {
  if (options.start) {
    return *options.start;
  }
  double scale = options.rate_per_unit.value_or(0.0);
  if (!options.rate_per_unit) {
    const TurnSet set(turns, bias);
    const auto best_of = [&](const std::vector<double>& scales) {
      double least = std::numeric_limits<double>::infinity();
      for (const double candidate : scales) {
        const double cost = set.at(candidate * Eigen::Matrix3d::Identity()).cost();
        if (cost < least) {
          least = cost;
          scale = candidate;
        }
      }
      return least;
    };
    if (rms_of(best_of(usual_scales()), turns.size()) >= 2.0 * good_rms_rad) {
      best_of(all_scales());
    }
  }
  return scale * Eigen::Matrix3d::Identity();
}

// Computes the derivative of B and the bias with respect to the record's parameters. The parameters
// of axis k are its bias and row k of the sensitivity matrix S = B^-1. The formula for B is dB = -B
// dS B.
Eigen::Matrix<double, 12, 12> unknowns_by_parameters(const Eigen::Matrix3d& B) {
  Eigen::Matrix<double, 12, 12> change = Eigen::Matrix<double, 12, 12>::Zero();
  for (int k = 0; k < 3; ++k) {
    change(9 + k, 4 * k) = 1.0;
    for (int j = 0; j < 3; ++j) {
      for (int p = 0; p < 3; ++p) {
        for (int q = 0; q < 3; ++q) {
          change(3 * p + q, 4 * k + 1 + j) = -B(p, k) * B(j, q);
        }
      }
    }
  }
  return change;
}

// Estimates the possible effect of the finite sampling rate on the residuals (method.md, section 4,
// turns). The residuals are computed twice, without the odd and without the even samples. The
// effect is a sixth of the difference.
class HalvedTurns {
 public:
  explicit HalvedTurns(std::span<const GyroscopeTurn> turns) : turns_(turns) {}

  [[nodiscard]] Eigen::VectorXd errors(const Candidate& at) const {
    return (residuals_of_half(at, 0) - residuals_of_half(at, 1)) / 6.0;
  }

 private:
  [[nodiscard]] Eigen::VectorXd residuals_of_half(const Candidate& at, std::size_t parity) const {
    std::vector<std::array<std::vector<double>, 4>> samples(turns_.size());  // x, y, z, time
    std::vector<GyroscopeTurn> turns(turns_.begin(), turns_.end());
    for (std::size_t t = 0; t < turns.size(); ++t) {
      const std::size_t last = turns_[t].time_s.size() - 1;
      const auto put = [&](std::size_t i, double time_s) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          samples[t][axis].push_back(turns_[t].readings[axis][i]);
        }
        samples[t][3].push_back(time_s);
      };
      // The gyroscope is at rest at both ends of a turn. The first or last sample is therefore
      // repeated one interval outside the turn.
      const std::span<const double> time_s = turns_[t].time_s;
      if (parity == 1) {
        put(0, 2.0 * time_s[0] - time_s[1]);
      }
      for (std::size_t i = parity; i <= last; i += 2) {
        put(i, time_s[i]);
      }
      if (last % 2 != parity) {
        put(last, 2.0 * time_s[last] - time_s[last - 1]);
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        turns[t].readings[axis] = samples[t][axis];
      }
      turns[t].time_s = samples[t][3];
    }
    return TurnSet(turns, at.bias).at(at.B).residuals;
  }

  std::span<const GyroscopeTurn> turns_;
};

// Returns the number of revolutions of the instrument during a turn. Rotations in opposite
// directions add up and do not cancel.
double revolutions_of(const GyroscopeTurn& turn, const TurnFit& fit) {
  double angle_rad = 0.0;
  for (std::size_t i = 1; i < turn.time_s.size(); ++i) {
    const Eigen::Vector3d reading(turn.readings[0][i], turn.readings[1][i], turn.readings[2][i]);
    angle_rad += (fit.inverse * (reading - fit.response.bias)).norm() *
                 (turn.time_s[i] - turn.time_s[i - 1]);
  }
  return angle_rad / (2.0 * std::numbers::pi);
}

// Throws if a turn has more revolutions than are possible by hand and the scale of the gyroscope is
// not given. The check is necessary because whole revolutions do not change the attitude at a rest,
// so a very wrong scale, or wrong times, may fit too.
void check_revolutions(std::span<const GyroscopeTurn> turns,
                       const TurnFitOptions& options,
                       TurnFit& fit) {
  std::size_t worst = 0;
  for (std::size_t t = 0; t < turns.size(); ++t) {
    const double revolutions = revolutions_of(turns[t], fit);
    if (revolutions > fit.most_revolutions) {
      fit.most_revolutions = revolutions;
      worst = t;
    }
  }
  if (fit.most_revolutions > most_revolutions_by_hand && !options.rate_per_unit) {
    const std::span<const double> time_s = turns[worst].time_s;
    throw RefusedError(
        formatted("turn {} of the gyroscope would be {} revolutions in {} s, which is too fast for "
                  "turning by hand. Check whether the times are in another unit (name the column "
                  "t_ms, t_us, ...), or whether rests are missing. If a motor turned the "
                  "instrument, give the gyroscope's scale",
                  worst + 1, number_text(fit.most_revolutions, 3),
                  number_text(time_s.back() - time_s.front(), 3)),
        {settings::gyroscope_scale});
  }
}

}  // namespace

TurnFit fit_turns(std::span<const GyroscopeTurn> turns,
                  const RestFit& rests,
                  const TurnFitOptions& options) {
  const Eigen::Vector3d& bias = rests.bias;
  const Eigen::Index unknowns = options.fit_bias ? 12 : 9;
  TurnFit fit;
  fit.has_rotations = std::all_of(turns.begin(), turns.end(), [](const GyroscopeTurn& turn) {
    return turn.rotation_before_from_after.has_value();
  });
  double informative = 0.0;
  for (const GyroscopeTurn& turn : turns) {
    informative += turn.rotation_before_from_after ? 3.0 : 2.0;
  }
  fit.degrees_of_freedom = informative - static_cast<double>(unknowns);
  if (fit.degrees_of_freedom < 1.0) {
    throw RefusedError(
        formatted("{} turns are too few for the {} unknowns of a gyroscope; turn the gyroscope "
                  "from rest to rest {} times or more",
                  turns.size(), unknowns, fit.has_rotations ? "five" : "seven"));
  }
  const TurnProblem problem(turns, options.fit_bias);
  const Candidate start = problem.at(find_start(turns, bias, options), bias);
  auto search =
      gauss_newton(problem, start, {.most_rounds = most_turn_rounds, .settled = options.tolerance});
  Candidate& found = search.state;
  const double rms = rms_of(found.state.cost(), turns.size());
  if (!(rms < good_rms_rad)) {
    throw RefusedError(formatted(
        "the turns do not fit any scale of the gyroscope: with the best scale, {} rad/s per unit, "
        "the integrated attitudes differ from the attitudes at the rests by {} degrees (rms). "
        "Check whether the order and signs of the gyroscope's axes agree with those of the "
        "accelerometer; check the gyroscope's range and the labels of the seats",
        number_text(found.B.determinant() > 0.0 ? std::cbrt(found.B.determinant()) : 0.0, 3),
        number_text(rms * deg_per_rad, 3)));
  }
  if (!options.rotations_only) {
    require_determined(found.state.jacobian.leftCols(unknowns), fit, turns.size());
  } else if (leaves_room(start.state.jacobian.leftCols<9>())) {
    // use the fit of one common scale, because the other unknowns are not determined
    found = start;
  }
  fit.residual_sd_rad = std::sqrt(found.state.cost() / fit.degrees_of_freedom);
  // The last step weighs all errors by their estimated variances.
  const Eigen::Matrix<double, 12, 12> by_parameters = unknowns_by_parameters(found.B);
  if (fit.residual_sd_rad > 0.0 && !options.rotations_only) {
    WeighedTurns weighed = weigh_turns(
        {.turns = turns,
         .residuals = found.state.residuals,
         .jacobian = found.state.jacobian * by_parameters,
         .rotations = found.state.rotations,
         .sampling = options.whole_budget ? HalvedTurns(turns).errors(found) : Eigen::VectorXd()},
        without_earth(rests, found.B), options, fit.residual_sd_rad);
    const Eigen::Matrix<double, 12, 1> step = by_parameters * weighed.step;
    found =
        problem.at(found.B + Eigen::Map<const RowMajor3>(step.data()), found.bias + step.tail<3>());
    fit.residual_sd_rad = weighed.sd_rad;
    fit.rest_sd_rad = weighed.rest_sd_rad;
    fit.degrees_of_freedom = weighed.degrees_of_freedom;
    fit.covariance = std::move(weighed.covariance);
    fit.interval_95 = std::move(weighed.interval_95);
    fit.interval_dof = std::move(weighed.interval_dof);
    fit.components = std::move(weighed.components);
    fit.sources = std::move(weighed.sources);
  } else {
    fit.covariance = Eigen::MatrixXd::Zero(12, 12);
    fit.interval_95 = Eigen::VectorXd::Zero(12);
    fit.interval_dof = Eigen::VectorXd::Constant(12, fit.degrees_of_freedom);
  }
  fit.rounds = search.rounds;
  fit.converged = search.converged;
  fit.inverse = found.B;
  fit.response.bias = found.bias;
  fit.response.sensitivity = found.B.inverse();
  for (Eigen::Index i = 0; i < found.state.residuals.size(); i += 3) {
    fit.residuals.emplace_back(found.state.residuals.segment<3>(i));
  }
  check_revolutions(turns, options, fit);
  return fit;
}

Calibration turn_calibration(const TurnFit& fit,
                             const Instrument& instrument,
                             const Eigen::Vector3d& rest_sd) {
  Calibration record;
  record.provenance.created = output_timestamp();
  record.provenance.software = software_name();
  record.sensor.instrument = instrument;
  record.sensor.field = {.kind = "induced_rotation", .unit = "rad/s", .magnitude = 1.0};
  record.fit.method = Method::turns;
  record.sensor.response = fit.response;
  record.fit.turn_errors_rad = fit.residuals;
  FitStatistics& statistics = record.fit.statistics.emplace();
  statistics.observations = static_cast<int>(fit.residuals.size());
  statistics.degrees_of_freedom = Eigen::Vector3d::Constant(fit.degrees_of_freedom);
  statistics.residual_sd = rest_sd;
  statistics.r_squared = Eigen::Vector3d::Constant(not_a_number);
  statistics.covariance = fit.covariance;
  statistics.interval_95 = fit.interval_95;
  statistics.interval_dof = fit.interval_dof;
  statistics.components = fit.components;
  statistics.variance_inflation = SensitivityMatrix::Constant(3, 3, not_a_number);
  add_intervals(record);
  if (!fit.sources.empty()) {
    UncertaintyBudget& budget = record.fit.uncertainty.emplace();
    budget.sources.push_back({.name = "fit",
                              .type = "A",
                              .distribution = "t",
                              .input_u = not_a_number,
                              .degrees_of_freedom = not_a_number});
    budget.sources.insert(budget.sources.end(), fit.sources.begin(), fit.sources.end());
  }
  record.findings.notes.push_back(
      {NoteCode::turns,
       formatted(
           "{} turns{}: the errors of the integrated attitudes are {} degrees (standard deviation "
           "of a component){}",
           fit.residuals.size(),
           fit.has_rotations ? " between known seats"
                             : " between rests with attitudes from the "
                               "accelerometer",
           number_text(fit.residual_sd_rad * deg_per_rad, 3),
           fit.rest_sd_rad > 0.0 ? formatted("; of this, the error of the attitude at a rest, "
                                             "which two consecutive turns share, causes {} degrees",
                                             number_text(fit.rest_sd_rad * deg_per_rad, 3))
                                 : std::string())});
  if (!fit.converged) {
    add_warning(record, {.code = WarningCode::not_converged,
                         .message = "the fit of the turns did not converge in 50 rounds; check "
                                    "whether the gyroscope saturates during the turns"});
  }
  if (fit.most_revolutions > most_revolutions_by_hand) {
    add_warning(record, {.code = WarningCode::many_revolutions,
                         .message = formatted("with the stated scale, a turn between two rests is "
                                              "{} revolutions; check the scale and the times",
                                              number_text(fit.most_revolutions, 3))});
  }
  return record;
}

std::vector<Eigen::Matrix3d> integrated_rotations(std::span<const GyroscopeTurn> turns,
                                                  const TurnFit& fit) {
  return TurnSet(turns, fit.response.bias).at(fit.inverse).rotations;
}

}  // namespace axiscal
