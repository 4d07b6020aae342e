// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/saturated_axes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "calib/fit/reading_step.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

constexpr std::size_t fewest_there = 2;
constexpr std::size_t fewest_others = 6;

// The readings of an axis, divided into those at its extreme value and the others.
struct EndOfAxis {
  Eigen::Index axis = 0;
  double sign = 1.0;                 // 1 for the largest value of the axis, -1 for the smallest
  double value = 0.0;                // the extreme value
  double step = 0.0;                 // rounding step of the axis; 0 if not known
  std::vector<Eigen::Index> there;   // readings at the extreme value
  std::vector<Eigen::Index> others;  // all other readings that the axis uses
};

// Returns true if an extreme value is read more than once. The comparison ignores the last bits,
// because means of equal readings may differ in them. Other readings differ by a rounding step or
// more.
bool are_met(const std::vector<double>& values, double end) {
  constexpr double last_bits = 16.0 * std::numeric_limits<double>::epsilon();
  return std::count_if(values.begin(), values.end(), [&](double value) {
           return std::abs(value - end) <= last_bits * std::abs(end);
         }) > 1;
}

// Finds the readings of an axis at its largest value (sign 1) or at its smallest value (sign -1).
// @param values  the readings of the axis, from readings_of_axis().
// @return nullopt if there are too few readings at the extreme value, or too few others.
std::optional<EndOfAxis> end_of_axis(const ReadingSet& set,
                                     Eigen::Index k,
                                     const std::vector<double>& values,
                                     double sign,
                                     double step) {
  EndOfAxis end{.axis = k, .sign = sign, .step = step};
  end.value = sign > 0.0 ? *std::max_element(values.begin(), values.end())
                         : *std::min_element(values.begin(), values.end());
  const auto is_there = [&](double value) { return std::abs(value - end.value) <= 0.5 * step; };
  const auto there =
      static_cast<std::size_t>(std::count_if(values.begin(), values.end(), is_there));
  if (there < fewest_there || values.size() - there < fewest_others) {
    return std::nullopt;
  }
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    if (set.weights(i, k) > 0.0) {
      (is_there(set.response(i, k)) ? end.there : end.others).push_back(i);
    }
  }
  return end;
}

double upper_tail(double t, double degrees_of_freedom) {
  const double both = student_t_two_sided_p(t, degrees_of_freedom);
  return t > 0.0 ? 0.5 * both : 1.0 - 0.5 * both;
}

double probability_of(double excess, double sd, double degrees_of_freedom) {
  return sd > 0.0 ? upper_tail(excess / sd, degrees_of_freedom) : 1.0;
}

// Predicts the readings at the extreme value from the other readings. Returns the probability that
// the readings fall short of the prediction this much by chance. Returns nullopt if the other
// readings do not determine the fit.
std::optional<double> p_by_others(const ReadingSet& set,
                                  const Eigen::MatrixXd& design,
                                  const EndOfAxis& end) {
  const Eigen::VectorXd root = set.weights.col(end.axis)(end.others).cwiseSqrt();
  const Eigen::MatrixXd X = root.asDiagonal() * design(end.others, Eigen::all);
  // Readings relative to the extreme value, so that large readings lose no digits.
  const Eigen::VectorXd y =
      root.asDiagonal() * (set.response.col(end.axis)(end.others).array() - end.value).matrix();
  const Eigen::Index nu = X.rows() - X.cols();
  if (nu < 1) {
    return std::nullopt;
  }
  const Factor factor(X);
  if (!factor.has_full_rank()) {
    return std::nullopt;
  }
  const Eigen::VectorXd estimate = factor.solve(y);
  const double scatter =
      std::sqrt(std::max({(y - X * estimate).squaredNorm() / static_cast<double>(nu),
                          end.step * end.step / 12.0, std::pow(set.rounding(end.axis), 2)}));
  const Eigen::RowVectorXd g = design(end.there, Eigen::all).colwise().mean();
  const Eigen::RowVectorXd a = g * factor.root_of_covariance();  // |a|^2: variance of g * estimate
  const double short_of = end.sign * g.dot(estimate) - 0.5 * end.step;
  return probability_of(
      short_of, scatter * std::sqrt(a.squaredNorm() + 1.0 / static_cast<double>(end.there.size())),
      static_cast<double>(nu));
}

// Like p_by_others(), for method magnitude. The directions of the field are not known, so they are
// computed from the readings.
double p_by_magnitude(const ReadingSet& set,
                      const Estimate& estimate,
                      double magnitude,
                      const EndOfAxis& end) {
  const LinearResponse& response = estimate.response;
  const Eigen::Matrix3d S = response.sensitivity;
  const Eigen::Matrix3d inverse = S.inverse();
  double short_of = -0.5 * end.step;
  for (const Eigen::Index i : end.there) {
    const Eigen::Vector3d field = inverse * (set.response.row(i).transpose() - response.bias);
    const double expected =
        response.bias(end.axis) + magnitude * S.row(end.axis).dot(field.normalized());
    short_of += end.sign * (expected - end.value) / static_cast<double>(end.there.size());
  }
  return probability_of(short_of, estimate.statistics.residual_sd(end.axis),
                        estimate.statistics.degrees_of_freedom(end.axis));
}

}  // namespace

std::vector<SaturatedAxis> saturated_axes(const ReadingSet& set,
                                          const Estimate& estimate,
                                          const SaturationSearch& search) {
  // Limit of the p-value. With this limit, at most 0.2 % of simulated runs without saturation are
  // reported.
  constexpr double false_alarm = 0.02;
  const bool by_magnitude = !estimate.field.has_vectors() && !set.readings.front().field_in_sensor;
  const double ends = static_cast<double>(set.axis_count()) * (search.one_sided ? 1.0 : 2.0);
  std::optional<AxisDesigns> designs;  // computed when needed
  Eigen::MatrixXd steps;               // computed when needed
  std::vector<SaturatedAxis> found;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const std::vector<double> values = set.readings_of_axis(k);
    if (values.size() < fewest_there + fewest_others) {
      continue;
    }
    const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
    if (!(search.stated_step > 0.0) && !are_met(values, *lowest) && !are_met(values, *highest)) {
      continue;
    }
    if (steps.size() == 0) {
      steps = detect_rounding_steps(set.response, set.weights, search.stated_step);
    }
    const double step = steps.col(k).maxCoeff();
    for (const double sign : {1.0, -1.0}) {
      if (sign < 0.0 && search.one_sided) {
        continue;
      }
      const std::optional<EndOfAxis> end = end_of_axis(set, k, values, sign, step);
      if (!end) {
        continue;
      }
      if (!by_magnitude && !designs) {
        designs.emplace(set, estimate.field);
      }
      const double p =
          by_magnitude
              ? p_by_magnitude(set, estimate, search.magnitude, *end)
              : p_by_others(set, set.observable_columns(designs->of(k), k), *end).value_or(1.0);
      if (ends * p < false_alarm) {
        SaturatedAxis& axis =
            found.emplace_back(SaturatedAxis{.axis = k, .value = end->value, .runs = {}});
        for (const Eigen::Index i : end->there) {
          axis.runs.push_back(set.readings[static_cast<std::size_t>(i)].run);
        }
      }
    }
  }
  return found;
}

}  // namespace axiscal
