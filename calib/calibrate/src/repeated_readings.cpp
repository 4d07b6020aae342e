// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/repeated_readings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "calib/fit/fit.hpp"
#include "calib/fit/reading_step.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Finds series of consecutive readings that equal earlier readings in the same poses. In a series,
// the distance in rows between a reading and the equal earlier reading is constant.
std::vector<RepeatedReadings> equal_readings(const PreparedRun& run) {
  const Observations& observations = run.observations();
  const Eigen::MatrixXd& y = observations.response;
  std::vector<std::size_t> order = run.rows_not_left_out();
  const auto compare = [&](std::size_t a, std::size_t b) {
    for (Eigen::Index k = 0; k < y.cols(); ++k) {
      const double difference =
          y(static_cast<Eigen::Index>(a), k) - y(static_cast<Eigen::Index>(b), k);
      if (difference != 0.0) {
        return difference < 0.0 ? -1 : 1;
      }
    }
    return 0;
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const int by_value = compare(a, b);
    return by_value != 0 ? by_value < 0 : a < b;
  });
  std::map<std::size_t, std::set<std::size_t>> copies;  // distance in rows -> rows of the copies
  for (std::size_t i = 1; i < order.size(); ++i) {
    const std::size_t original = order[i - 1];
    const std::size_t copy = order[i];
    if (compare(original, copy) == 0 &&
        in_one_pose(observations.readings[original], observations.readings[copy])) {
      copies[copy - original].insert(copy);
    }
  }
  std::vector<RepeatedReadings> equal;
  for (const auto& [distance, rows] : copies) {
    for (const std::size_t copy : rows) {
      if (equal.empty() || equal.back().rows.back() != std::pair(copy - 1 - distance, copy - 1)) {
        equal.emplace_back();
      }
      equal.back().rows.emplace_back(copy - distance, copy);
    }
  }
  return equal;
}

// Returns the standard deviation of the noise of each axis. It is estimated from the median of the
// absolute residuals, which a few wrong readings hardly change.
Eigen::VectorXd noise_of(const PreparedRun& run, const FittedRun& fit) {
  Eigen::VectorXd sd = fit.estimate.statistics.residual_sd;
  if (run.method().by_magnitude || fit.set->seen.cols() > 0) {
    return sd;
  }
  const Fit linear(fit.readings(run.method()), fit.estimate);
  for (Eigen::Index k = 0; k < linear.axes(); ++k) {
    Eigen::VectorXd sizes = linear.residuals()(linear.rows_of_axis(k)).cwiseAbs();
    const auto middle = sizes.begin() + sizes.size() / 2;
    std::nth_element(sizes.begin(), middle, sizes.end());
    constexpr double sd_of_middle = 1.4826;
    sd(k) = std::min(sd(k), sd_of_middle * *middle * linear.sigma(k));
  }
  return sd;
}

// Returns, for each of the n readings, the probability that another reading in the same pose is
// equal in every axis by chance.
Eigen::VectorXd chances_of_equal(const PreparedRun& run, const FittedRun& fit) {
  const Eigen::VectorXd noise = noise_of(run, fit);
  const Eigen::MatrixXd& response = run.observations().response;
  const Eigen::MatrixXd steps =
      detect_rounding_steps(response, Eigen::MatrixXd::Ones(response.rows(), response.cols()),
                            run.experiment().stated.resolution, noise);
  Eigen::VectorXd chances = Eigen::VectorXd::Ones(steps.rows());
  for (Eigen::Index k = 0; k < steps.cols(); ++k) {
    if (!(noise(k) > 0.0)) {
      continue;  // without noise, all readings in one pose are equal
    }
    constexpr double digits_of_a_number = 16.0 * std::numeric_limits<double>::epsilon();
    const double least = digits_of_a_number * response.col(k).cwiseAbs().maxCoeff();
    // The probability that two readings are equal is the rounding step times the probability
    // density of their difference at 0.
    const double density = 1.0 / (2.0 * std::sqrt(std::numbers::pi) * noise(k));
    chances.array() *= (density * steps.col(k).array().max(least)).min(1.0);
  }
  return chances;
}

double pairs_in_one_pose(const std::vector<Reading>& readings, std::size_t distance) {
  double pairs = 0.0;
  for (std::size_t i = 0; i + distance < readings.size(); ++i) {
    pairs += in_one_pose(readings[i], readings[i + distance]) ? 1.0 : 0.0;
  }
  return pairs;
}

// Returns the number of tests for copies: the number of different distances, in rows, between two
// readings in one pose. For many readings an upper bound is returned.
double distances_with_pairs(const std::vector<Reading>& readings) {
  constexpr std::size_t most_counted = 500;
  if (readings.size() > most_counted) {
    return static_cast<double>(readings.size());
  }
  double count = 0.0;
  for (std::size_t distance = 1; distance < readings.size(); ++distance) {
    count += pairs_in_one_pose(readings, distance) > 0.0 ? 1.0 : 0.0;
  }
  return count;
}

CalibrationWarning warning_of(const RepeatedReadings& repeats, const Observations& observations) {
  const auto run_of = [&](std::size_t row) { return observations.readings[row].run; };
  std::vector<int> originals;
  std::vector<int> copies;
  for (const auto& [original, copy] : repeats.rows) {
    originals.push_back(run_of(original));
    copies.push_back(run_of(copy));
  }
  if (originals == copies) {  // the run numbers were copied too
    for (std::size_t i = 0; i < copies.size(); ++i) {
      originals[i] = static_cast<int>(repeats.rows[i].first) + 1;
      copies[i] = static_cast<int>(repeats.rows[i].second) + 1;
    }
  }
  const auto names = [](const std::vector<int>& runs) {
    const bool is_range = runs.size() > 2 &&
                          std::adjacent_find(runs.begin(), runs.end(),
                                             [](int a, int b) { return b != a + 1; }) == runs.end();
    return is_range ? formatted("runs {} to {}", runs.front(), runs.back()) : name_of_runs(runs);
  };
  return {.code = WarningCode::repeated_readings,
          .runs = copies,
          .message = formatted(
              "{} {} {} in every digit of every axis: {} left out, because a copy adds no "
              "information; delete the copied rows, or enter the values that were read",
              names(copies), copies.size() == 1 ? "repeats" : "repeat", names(originals),
              copies.size() == 1 ? "it was" : "they were")};
}

}  // namespace

std::vector<RepeatedReadings> find_repeats(const PreparedRun& run, const FittedRun& fit) {
  const Observations& observations = run.observations();
  const std::vector<RepeatedReadings> equal = equal_readings(run);
  if (equal.empty()) {
    return {};
  }
  constexpr double rarest = 1e-3;
  const Eigen::VectorXd chances = chances_of_equal(run, fit);
  const double distances = distances_with_pairs(observations.readings);
  std::vector<RepeatedReadings> found;
  for (const RepeatedReadings& repeats : equal) {
    double probability = distances;
    for (const auto& [original, copy] : repeats.rows) {
      probability *= chances(static_cast<Eigen::Index>(copy));
    }
    // Counting the pairs of readings in one pose takes time. Therefore the pairs are counted only
    // if `probability` is below the limit, which is not so for most series.
    const auto& [original, copy] = repeats.rows.front();
    if (probability < rarest &&
        probability * pairs_in_one_pose(observations.readings, copy - original) < rarest) {
      found.push_back(repeats);
    }
  }
  return found;
}

std::vector<std::size_t> duplicate_rows(const std::vector<RepeatedReadings>& repeats) {
  std::vector<std::size_t> rows;
  for (const RepeatedReadings& one : repeats) {
    for (const auto& [original, copy] : one.rows) {
      rows.push_back(copy);
    }
  }
  return rows;
}

std::vector<CalibrationWarning> warnings_of(const std::vector<RepeatedReadings>& repeats,
                                            const Observations& observations) {
  std::vector<CalibrationWarning> warnings;
  for (const RepeatedReadings& one : repeats) {
    warnings.push_back(warning_of(one, observations));
  }
  return warnings;
}

}  // namespace axiscal
