// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/confirmation_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "calib/fit/deletion_fit.hpp"
#include "calib/fit/model.hpp"
#include "calib/regression/common_noise.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd below(const Eigen::MatrixXd& above, const Eigen::MatrixXd& more) {
  Eigen::MatrixXd both(above.rows() + more.rows(), above.cols());
  both << above, more;
  return both;
}

template <typename Value>
void append(const std::vector<Value>& more, std::vector<Value>& all) {
  all.insert(all.end(), more.begin(), more.end());
}

// Returns the readings of the fit, followed by the readings that were kept out.
ReadingSet both_of(ReadingSet set, const ReadingSet& kept_out) {
  append(kept_out.readings, set.readings);
  for (std::size_t i = 0; i < kept_out.rotation_sensor_from_table.size(); ++i) {
    set.rotation_sensor_from_table.push_back(kept_out.rotation_sensor_from_table[i]);
  }
  append(kept_out.field_then, set.field_then);
  set.response = below(set.response, kept_out.response);
  set.weights = below(set.weights, kept_out.weights);
  set.effects.columns = below(set.effects.columns, kept_out.effects.columns);
  set.effects.memory = below(set.effects.memory, kept_out.effects.memory);
  if (set.temperature.order > 0) {
    set.temperature.d = below(set.temperature.d, kept_out.temperature.d);
    set.temperature.soak.clear();
  }
  return set;
}

// Returns the cosine of the angle between the field and each axis, for each reading; n x m.
Eigen::MatrixXd cosines_of(const ReadingSet& set, const Solution& solution) {
  const Eigen::MatrixXd f =
      field_design(set, solution.field()).middleCols<3>(1).rowwise().normalized();
  return f * solution.coefficients().middleRows<3>(1).colwise().normalized();
}

// Changes the weights for noise whose variance across the field is `ratio` times its variance along
// the field. A variable seat of the cube causes noise in axes across the field. A fluctuating
// magnitude of the field causes noise in axes along the field.
ReadingSet with_noise_ratio(ReadingSet set, const Eigen::MatrixXd& cosines, double ratio) {
  const Eigen::ArrayXXd across = 1.0 - cosines.array().square();
  set.weights.array() /= 1.0 + (ratio - 1.0) * across;
  return set;
}

struct Likelihood {
  double minus_twice_log = 0.0;  // -2 times the restricted log likelihood, up to a constant
  double loss = 1.0;             // result of dof_reduction_factor()
};

// Returns the likelihood of the readings, or nullopt if they do not determine the fit.
std::optional<Likelihood> likelihood_of(const ReadingSet& set,
                                        const TableField& field,
                                        bool known_field) {
  const std::shared_ptr<const Solution> solution = Model(set, known_field).at({.field = field});
  const auto m = static_cast<Eigen::Index>(solution->axes.size());
  const SharedSums& sums = solution->sums;
  Eigen::VectorXd smallest(m);
  Eigen::MatrixXd residuals(set.size(), m);
  for (Eigen::Index k = 0; k < m; ++k) {
    residuals.col(k) = solution->axes[static_cast<std::size_t>(k)].residuals;
    smallest(k) = std::max(set.rounding(k), std::numeric_limits<double>::min());
  }
  const Eigen::VectorXd start =
      sums.squares.cwiseQuotient(sums.degrees_of_freedom).cwiseSqrt().cwiseMax(smallest);
  const std::optional<AxisNoise> noise = Model::noise(*solution, start, smallest);
  if (!noise) {
    return std::nullopt;
  }
  Likelihood likelihood{.loss = dof_reduction_factor(residuals, noise->degrees_of_freedom.mean())};
  for (Eigen::Index k = 0; k < m; ++k) {
    const AxisSolution& axis = solution->axes[static_cast<std::size_t>(k)];
    const Eigen::MatrixXd X = axis.root_weights().asDiagonal() * axis.X();
    const auto counts = (set.weights.col(k).array() > 0.0);
    likelihood.minus_twice_log += 2.0 * sums.degrees_of_freedom(k) * std::log(noise->sigma(k)) +
                                  noise->degrees_of_freedom(k) +
                                  PositiveFactor(X.transpose() * X).log_determinant() -
                                  counts.select(set.weights.col(k).array(), 1.0).log().sum();
  }
  if (solution->shared_count() > 0) {
    likelihood.minus_twice_log -=
        PositiveFactor(Model::cost_of_shared(*solution, noise->sigma).covariance).log_determinant();
  }
  return likelihood;
}

// Returns contrasts of the readings, one in each row. If a block may have a shift that its readings
// share, the contrasts are differences within the block, so the shift cancels. The contrasts of
// other blocks are the readings themselves.
// @param is_shifted  function that returns true if a block may have a shift.
template <typename IsShifted>
Eigen::MatrixXd contrasts_of(const std::vector<Reading>& readings, const IsShifted& is_shifted) {
  std::map<int, std::vector<Eigen::Index>> blocks;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    blocks[readings[i].block].push_back(static_cast<Eigen::Index>(i));
  }
  const auto n = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd contrasts(0, n);
  for (const auto& [block, members] : blocks) {
    const auto count = static_cast<Eigen::Index>(members.size());
    Eigen::MatrixXd own = Eigen::MatrixXd::Identity(count, count);
    if (is_shifted(block)) {
      own = orthogonal_complement(Eigen::MatrixXd::Ones(count, 1)).transpose();
    }
    const Eigen::Index first = contrasts.rows();
    contrasts.conservativeResize(first + own.rows(), Eigen::NoChange);
    contrasts.bottomRows(own.rows()).setZero();
    contrasts.bottomRows(own.rows())(Eigen::all, members) = own;
  }
  return contrasts;
}

// Computes the p-value of the kept-out readings for several ratios of the noise across the field to
// the noise along it. Returns the largest one, over the ratios that the readings of the fit do not
// reject at 5 %.
std::optional<double> p_of_kept_out(const ReadingSet& fitted,
                                    const ReadingSet& all,
                                    const std::vector<std::size_t>& places,
                                    const Eigen::MatrixXd& contrasts,
                                    const TableField& field,
                                    bool known_field) {
  const Eigen::MatrixXd cosines = cosines_of(all, *Model(all, known_field).at({.field = field}));
  struct Trial {
    Likelihood likelihood;
    double p_value = 0.0;
  };
  std::vector<Trial> trials;
  double least = std::numeric_limits<double>::infinity();
  for (const double ratio : {0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0}) {
    const ReadingSet weighed = with_noise_ratio(fitted, cosines.topRows(fitted.size()), ratio);
    const std::optional<Likelihood> likelihood = likelihood_of(weighed, field, known_field);
    const ReadingSet weighed_all = with_noise_ratio(all, cosines, ratio);
    const std::optional<double> p = likelihood ? DeletionFit(weighed_all, field, known_field)
                                                     .p_value(places, contrasts, likelihood->loss)
                                               : std::nullopt;
    if (p) {
      trials.push_back({.likelihood = *likelihood, .p_value = *p});
      least = std::min(least, likelihood->minus_twice_log);
    }
  }
  constexpr double rejected = 3.84;  // chi^2 of one degree of freedom at 5 %
  std::optional<double> largest;
  for (const Trial& trial : trials) {
    if (trial.likelihood.minus_twice_log - least <= rejected) {
      largest = std::max(largest.value_or(0.0), trial.p_value);
    }
  }
  return largest;
}

}  // namespace

ConfirmedReadings confirmed(const ReadingSet& fitted,
                            const ReadingSet& kept_out,
                            const TableField& field,
                            bool known_field) {
  const ReadingSet set = both_of(fitted, kept_out);
  std::vector<std::size_t> places(kept_out.readings.size());
  std::iota(places.begin(), places.end(), fitted.readings.size());
  const DeletionFit fit(set, field, known_field);
  const auto is_unknown = [&](int block) {
    return std::none_of(fitted.readings.begin(), fitted.readings.end(),
                        [&](const Reading& reading) { return reading.block == block; });
  };
  const auto p_with = [&](const Eigen::MatrixXd& contrasts) {
    return p_of_kept_out(fitted, set, places, contrasts, field, known_field);
  };
  const Eigen::MatrixXd each = contrasts_of(kept_out.readings, [](int) { return false; });
  const Eigen::MatrixXd within = contrasts_of(kept_out.readings, is_unknown);
  const bool is_new_block = within.rows() < each.rows() && within.rows() > 0;
  const std::optional<double> p = p_with(is_new_block ? within : each);
  const auto predictions = fit.predictions(places);
  if (!p || !predictions) {
    throw RefusedError(
        "the fit has too few readings to be compared with the confirmation readings ('confirm'); "
        "take more readings");
  }
  constexpr double unlikely = 0.05;
  ConfirmedReadings result;
  if (is_new_block) {
    result.notes.push_back(
        {NoteCode::conditions,
         "The confirmation readings are from a block that the fit does not contain. A shift of the "
         "bias that is common to all of them is therefore not tested"});
  } else if (within.rows() < each.rows()) {
    result.notes.push_back(
        {NoteCode::conditions,
         "The confirmation readings are from a block that the fit does not contain. Their "
         "intervals do not include the change of the biases from block to block"});
  } else if (*p < unlikely) {
    const Eigen::MatrixXd without_shift = contrasts_of(kept_out.readings, [](int) { return true; });
    if (without_shift.rows() > 0 && p_with(without_shift).value_or(0.0) >= unlikely) {
      result.notes.push_back(
          {NoteCode::conditions,
           "A common shift of the biases explains the errors of the confirmation readings. If "
           "these readings were taken after a new set-up, give them their own block number"});
    }
  }
  Confirmation& confirmation = result.confirmation;
  confirmation = {.readings = {}, .p_value = *p, .passed = *p >= unlikely};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const DeletionFit::Prediction& prediction = (*predictions)[i];
    ConfirmationReading& reading = confirmation.readings.emplace_back(ConfirmationReading{
        .run = kept_out.readings[i].run, .error = prediction.error, .half_width = prediction.sd});
    for (Eigen::Index k = 0; k < reading.error.size(); ++k) {
      reading.half_width(k) *= student_t_factor(0.95, prediction.degrees_of_freedom(k));
      reading.within = reading.within && !(std::abs(reading.error(k)) > reading.half_width(k));
    }
  }
  return result;
}

}  // namespace axiscal
