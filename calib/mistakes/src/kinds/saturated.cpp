// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "calib/fit/reading_step.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array saturated_advice = {
    MistakeAdvice{.code = WarningCode::saturated,
                  .one = "Give the range of the axis, or set the instrument to a range that "
                         "includes the field. A curved response has the same effect."}};

// Returns the fitted response of an axis to the field at each reading, without the bias; n entries.
// @param base  field_design() of the fit.
Eigen::VectorXd sensed_by(const HypothesisFit& fit,
                          Eigen::Index axis,
                          const Eigen::MatrixXd& base) {
  return base.middleCols<3>(1) * fit.coefficients.col(axis).segment<3>(1);
}

// Returns the indices of the readings at one end of an axis's range.
// @param sensed  the response of the axis at each reading; see sensed_by().
// @param top     true for the upper end, false for the lower end.
std::vector<std::size_t> extremes(const Eigen::VectorXd& sensed, bool top) {
  const double sign = top ? 1.0 : -1.0;
  const double end = sign * (top ? sensed.maxCoeff() : sensed.minCoeff());
  std::vector<std::size_t> found;
  found.reserve(static_cast<std::size_t>(sensed.size()));
  for (Eigen::Index i = 0; i < sensed.size(); ++i) {
    if (sign * sensed(i) > end_of_range * end) {
      found.push_back(static_cast<std::size_t>(i));
    }
  }
  return found;
}

std::vector<std::size_t> extremes(const SuspectRun& run, Eigen::Index axis, bool top) {
  const HypothesisFit& fit = run.plain();
  return extremes(sensed_by(fit, axis, field_design(run.set(), fit.field)), top);
}

// Returns the column for a common shift of the readings at one end of an axis's range.
Eigen::MatrixXd extreme_columns(const SuspectRun& run, Eigen::Index axis, bool top) {
  Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), 1);
  for (const std::size_t i : extremes(run, axis, top)) {
    Z(run.n() * axis + static_cast<Eigen::Index>(i), 0) = 1.0;
  }
  return Z;
}

HypothesisFit fit_saturated(const SuspectRun& run, Eigen::Index axis, bool top) {
  const Eigen::MatrixXd Z = extreme_columns(run, axis, top);
  HypothesisFit fit = run.fitter().fit(run.set(), {}, [&](const auto&, const auto&) { return Z; });
  if (!fit.fitted) {
    return fit;
  }
  // Rounding can shift all readings at one end by half a step, and all readings at the other end by
  // half a step in the opposite direction. Therefore shifts of at most 1.5 steps are ignored.
  constexpr double both_ends = 1.5;
  const double step =
      detect_rounding_steps(run.set().response, run.set().weights, 0.0).col(axis).maxCoeff();
  return std::abs(fit.added(0)) > both_ends * step ? fit : HypothesisFit{};
}

// Returns the number of ends of ranges: two for each axis.
double count_of_ends(const SuspectRun& run) {
  return 2.0 * static_cast<double>(run.m());
}

double quick_p_of_ends(const SuspectRun& run, const HypothesisFit& fit) {
  const Eigen::MatrixXd base = field_design(run.set(), fit.field);
  double shifted = 0.0;
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    const Eigen::VectorXd sensed = sensed_by(fit, k, base);
    for (const bool top : {true, false}) {
      shifted = std::max(shifted, run.rss_drop_with_shift(fit, k, extremes(sensed, top)));
    }
  }
  return count_of_ends(run) * nested_f_p(fit.total(), fit.dof(), shifted, 1.0);
}

void detect_ends(const SuspectRun& run, const Consider& consider) {
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    for (const bool top : {true, false}) {
      const HypothesisFit with = fit_saturated(run, k, top);
      if (with.fitted) {
        const double by_poses = nested_p_of_poses(
            run, [&](const SuspectRun& means) { return fit_saturated(means, k, top); });
        consider(with, {.tests = count_of_ends(run), .at_least = by_poses});
      }
    }
  }
}

void explain_by_saturation(const SuspectRun& run, Explanations& found) {
  for (Eigen::Index k = 0; k < run.m(); ++k) {
    for (const bool top : {true, false}) {
      const std::vector<std::size_t> readings = extremes(run, k, top);
      Correction correction = about(run, WarningCode::saturated, readings);
      HypothesisFit fit = fit_saturated(run, k, top);
      if (fit.fitted && (fit.added(0) > 0.0) == top) {
        // Saturation makes readings too low at the upper end and too high at the lower end. A shift
        // in the other direction is not saturation.
        continue;
      }
      found.add(std::move(fit), {drift_range * run.full_response(k)}, count_of_ends(run),
                std::move(correction),
                std::string("with axis ") + run.set().axes[static_cast<std::size_t>(k)] +
                    (top ? " limited at its upper end" : " limited at its lower end"));
    }
  }
}

}  // namespace

MistakeKind saturated_kind() {
  return {.advice = saturated_advice,
          .of_run = explain_by_saturation,
          .quick_p = quick_p_of_ends,
          .detect = detect_ends};
}

}  // namespace axiscal
