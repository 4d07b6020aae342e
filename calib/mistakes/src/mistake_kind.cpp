// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/mistake_kind.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "axiscal/calib/distributions.hpp"

namespace axiscal {
namespace {

// Returns the log-likelihood of an explanation.
// @param ranges        the ranges of the added parameters.
// @param alternatives  the number of explanations of the same kind.
double likelihood(const HypothesisFit& fit,
                  const std::vector<double>& ranges,
                  double alternatives) {
  const double nu = fit.dof();
  double value = -0.5 * nu * std::log(fit.total()) + std::lgamma(0.5 * nu);
  for (std::size_t q = 0; q < ranges.size(); ++q) {
    value += 0.5 * std::log(std::numbers::pi / fit.information(static_cast<Eigen::Index>(q))) -
             std::log(ranges[q]);
  }
  return value - std::log(alternatives);
}

// The sum of squares of the residuals' components perpendicular to the field of each reading.
struct PerpendicularResiduals {
  double squares = 0.0;
  double degrees_of_freedom = 0.0;
};

PerpendicularResiduals across_field(const SuspectRun& run, const HypothesisFit& fit) {
  const ReadingSet& set = run.set();
  PerpendicularResiduals left{.squares = fit.total(), .degrees_of_freedom = fit.dof()};
  for (std::size_t i = 0; i < run.count(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd response = fit.coefficients.middleRows<3>(1).transpose() *
                                     set.met_of_field(i) * fit.field.vector(set.tilt_of(i));
    const Eigen::VectorXd along = set.weights.row(row)
                                      .transpose()
                                      .cwiseSqrt()
                                      .cwiseProduct(response)
                                      .cwiseQuotient(run.fitter().scale())
                                      .normalized();
    left.squares -= std::pow(fit.residuals.row(row) * along, 2);
    left.degrees_of_freedom -= along.squaredNorm();
    for (Eigen::Index k = 0; k < run.m(); ++k) {
      for (Eigen::Index l = 0; l < run.m(); ++l) {
        left.degrees_of_freedom += along(k) * along(l) * fit.fit->hat(k, row, l, row);
      }
    }
  }
  return left;
}

}  // namespace

namespace {

// The order matters: the explanation of the first kind wins if two are equally likely.
std::vector<MistakeKind>& all_kinds() {
  static std::vector<MistakeKind> kinds = {wrong_pose_kind(),  exchanged_kind(), wrong_value_kind(),
                                           wrong_level_kind(), stuck_kind(),     tilted_seat_kind(),
                                           table_moved_kind(), drift_kind(),     saturated_kind(),
                                           bias_step_kind(),   memory_kind()};
  return kinds;
}

}  // namespace

std::span<const MistakeKind> mistake_kinds() {
  return all_kinds();
}

void add_mistake_kind(const MistakeKind& kind) {
  all_kinds().push_back(kind);
}

void Explanations::add(HypothesisFit fit,
                       const std::vector<double>& ranges,
                       double alternatives,
                       Correction correction,
                       std::string words,
                       double surely) {
  if (!fit.fitted || !(fit.dof() >= 1.0)) {
    return;
  }
  Explanation explanation{.likelihood = likelihood(fit, ranges, alternatives) + surely,
                          .fit = std::move(fit),
                          .correction = std::move(correction),
                          .words = std::move(words)};
  explanation.fit.forget_readings();
  all_.push_back(std::move(explanation));
}

std::vector<Explanation> Explanations::ranked() && {
  std::stable_sort(all_.begin(), all_.end(), [](const Explanation& a, const Explanation& b) {
    return a.likelihood > b.likelihood;
  });
  return std::move(all_);
}

double nested_f_p(double total, double dof, double drop, double q, double loss) {
  const double left = total - drop;
  constexpr double none_freed = 0.5;
  if (!(dof - q >= 1.0) || !(q > none_freed) || !(drop > 0.0)) {
    return 1.0;
  }
  return left > 0.0 ? f_upper_p((drop / q) / (left / (dof - q)), q / loss, (dof - q) / loss) : 0.0;
}

double nested_p_across_field(const SuspectRun& run, const HypothesisFit& with) {
  // With fewer axes, the residual along the field is not determined.
  constexpr Eigen::Index fewest_axes = 3;
  if (!with.fitted || run.m() < fewest_axes) {
    return 0.0;
  }
  const PerpendicularResiduals before = across_field(run, run.plain());
  const PerpendicularResiduals after = across_field(run, with);
  return nested_f_p(before.squares, before.degrees_of_freedom, before.squares - after.squares,
                    run.plain().dof() - with.dof(), with.loss);
}

double nested_p_of_poses(const SuspectRun& run,
                         const std::function<HypothesisFit(const SuspectRun& means)>& fit) {
  const MeanReadings poses = average_poses(run.set(), run.estimate());
  if (!poses.own || !(poses.degrees_of_freedom.minCoeff() > 0.0)) {
    return 0.0;
  }
  const SuspectRun means(poses.set(), run.estimate(), run.fitter().known_field());
  const HypothesisFit with = fit(means);
  constexpr double clearly_more = 0.02;
  if (!means.plain().fitted ||
      !(between_groups_p(with, means.fitter().scale(), poses) < clearly_more)) {
    return 0.0;
  }
  return nested_f_p(means.plain().total(), means.plain().dof(),
                    means.plain().total() - with.total(), means.plain().dof() - with.dof(),
                    with.loss);
}

Correction about(const SuspectRun& run,
                 WarningCode code,
                 const std::vector<std::size_t>& readings) {
  Correction correction{.code = code};
  for (const std::size_t i : readings) {
    correction.runs.push_back(run.run_of(i));
  }
  return correction;
}

ReadingSet one_reading(const ReadingSet& set, std::size_t i) {
  ReadingSet one = set;
  const auto row = static_cast<Eigen::Index>(i);
  one.readings = {set.readings[i]};
  one.response = set.response.row(row);
  one.weights = set.weights.row(row);
  one.rotation_sensor_from_table = {set.rotation_sensor_from_table[i]};
  if (!set.field_then.empty()) {
    one.field_then = {set.field_then[i]};
  }
  one.effects = set.effects.of_means({{row}});
  if (set.temperature.order > 0) {
    one.temperature.d = set.temperature.d.row(row);
    one.temperature.soak = {set.soak_of(i)};
  }
  return one;
}

double distance_squared(const SuspectRun& run,
                        const ReadingSet& one,
                        const HypothesisFit& without,
                        const Eigen::VectorXd& response) {
  const Eigen::VectorXd expected = predict_from_other_readings(run, one, without);
  return (response - expected).cwiseQuotient(run.fitter().scale()).squaredNorm();
}

Eigen::VectorXd predict_from_other_readings(const SuspectRun& run,
                                            const ReadingSet& one,
                                            const HypothesisFit& without) {
  const Eigen::MatrixXd base = field_design(one, without.field);
  Eigen::VectorXd expected(run.m());
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    expected(k) = one.all_columns(base, k).row(0).dot(without.coefficients.col(k).transpose());
  }
  return expected;
}

}  // namespace axiscal
