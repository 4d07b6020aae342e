// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/unsettled_readings.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A laying (a series of consecutive readings in one pose) with fewer readings than this is not
// tested.
constexpr Eigen::Index fewest_readings = 4;
constexpr std::size_t fewest_layings = 6;

// A laying: a series of consecutive readings in one pose, after the cube was laid down.
struct Laying {
  Eigen::Index first = 0;  // index of the first reading in the list of rows
  Eigen::Index readings = 0;
};

// Returns the layings with at least fewest_readings readings.
std::vector<Laying> long_layings(const std::vector<Reading>& readings,
                                 const std::vector<std::size_t>& rows) {
  const auto continues = [](const Reading& before, const Reading& now) {
    return in_one_pose(before, now) && before.block == now.block && before.confirm == now.confirm;
  };
  std::vector<Laying> layings;
  for (std::size_t i = 0; i < rows.size();) {
    std::size_t end = i + 1;
    while (end < rows.size() && continues(readings[rows[i]], readings[rows[end]])) {
      ++end;
    }
    if (end - i >= static_cast<std::size_t>(fewest_readings)) {
      layings.push_back(
          {.first = static_cast<Eigen::Index>(i), .readings = static_cast<Eigen::Index>(end - i)});
    }
    i = end;
  }
  return layings;
}

// The differences that the test compares: the first (or the last) reading of each laying minus the
// mean of the other readings of the laying. Each matrix has a row for each laying and a column for
// each axis.
struct Ends {
  Eigen::MatrixXd first;
  Eigen::MatrixXd last;
};

// Computes the differences of all layings.
// @param left_out  number of readings to ignore at the start of each laying.
Ends ends_of(const std::vector<Laying>& layings,
             const Eigen::MatrixXd& response,
             Eigen::Index left_out) {
  const auto count = static_cast<Eigen::Index>(layings.size());
  Ends ends{.first = Eigen::MatrixXd(count, response.cols()),
            .last = Eigen::MatrixXd(count, response.cols())};
  for (Eigen::Index l = 0; l < count; ++l) {
    const Laying& laying = layings[static_cast<std::size_t>(l)];
    const auto rows = response.middleRows(laying.first + left_out, laying.readings - left_out);
    const Eigen::Index n = rows.rows();
    ends.first.row(l) = rows.row(0) - rows.bottomRows(n - 1).colwise().mean();
    ends.last.row(l) = rows.row(n - 1) - rows.topRows(n - 1).colwise().mean();
  }
  return ends;
}

bool starts_differ(const Ends& ends) {
  constexpr double by_chance = 0.001;
  const auto layings = static_cast<double>(ends.first.rows());
  FisherSum axes;
  for (Eigen::Index k = 0; k < ends.first.cols(); ++k) {
    const double last = ends.last.col(k).squaredNorm();
    if (last > 0.0) {
      axes.add(
          f_upper_p(std::max(ends.first.col(k).squaredNorm() / last, 1e-12), layings, layings));
    }
  }
  return axes.count() > 0.0 && axes.p_value() < by_chance;
}

}  // namespace

std::optional<UnsettledReadings> find_unsettled(const PreparedRun& run) {
  const Observations& observations = run.observations();
  const std::vector<Reading>& readings = observations.readings;
  if (readings.size() < fewest_layings * static_cast<std::size_t>(fewest_readings) ||
      !readings.front().point) {
    return std::nullopt;
  }
  const std::vector<std::size_t> rows = run.rows_not_left_out();
  const std::vector<Laying> layings = long_layings(readings, rows);
  if (layings.size() < fewest_layings) {
    return std::nullopt;
  }
  const Eigen::Index shortest =
      std::min_element(layings.begin(), layings.end(), [](const Laying& a, const Laying& b) {
        return a.readings < b.readings;
      })->readings;
  const Eigen::MatrixXd response = observations.response(rows, Eigen::all);
  Eigen::Index left_out = 0;
  double largest = 0.0;
  while (shortest - left_out >= fewest_readings - 1) {
    const Ends ends = ends_of(layings, response, left_out);
    if (!starts_differ(ends)) {
      break;
    }
    largest = std::max(largest, ends.first.cwiseAbs().maxCoeff());
    ++left_out;
  }
  if (left_out == 0) {
    return std::nullopt;
  }
  UnsettledReadings found;
  for (const Laying& laying : layings) {
    for (Eigen::Index i = 0; i < left_out; ++i) {
      const std::size_t row = rows[static_cast<std::size_t>(laying.first + i)];
      found.rows.push_back(row);
      found.warning.runs.push_back(readings[row].run);
    }
  }
  found.warning.code = WarningCode::unsettled;
  found.warning.message = formatted(
      "The instrument had not settled: in each pose, the first {} from the later readings, by up "
      "to {}. {} left out. Wait longer before the first reading",
      left_out == 1 ? std::string("reading differs") : formatted("{} readings differ", left_out),
      number_text(largest, 2), left_out == 1 ? "It was" : "They were");
  return found;
}

}  // namespace axiscal
