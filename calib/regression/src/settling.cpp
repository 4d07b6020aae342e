// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/settling.hpp"

#include <algorithm>

#include "axiscal/calib/distributions.hpp"

namespace axiscal {
namespace {

// The differences that the test compares: the first (or the last) reading of each series minus the
// mean of the other readings of the series. Each matrix has a row for each series and a column for
// each axis.
struct Ends {
  Eigen::MatrixXd first;
  Eigen::MatrixXd last;
};

// Computes the differences of all series.
// @param left_out  number of readings to ignore at the start of each series.
Ends ends_of(const std::vector<ReadingSeries>& all,
             const Eigen::MatrixXd& response,
             Eigen::Index left_out) {
  const auto count = static_cast<Eigen::Index>(all.size());
  Ends ends{.first = Eigen::MatrixXd(count, response.cols()),
            .last = Eigen::MatrixXd(count, response.cols())};
  for (Eigen::Index s = 0; s < count; ++s) {
    const ReadingSeries& one = all[static_cast<std::size_t>(s)];
    const auto rows = response.middleRows(one.first + left_out, one.readings - left_out);
    const Eigen::Index n = rows.rows();
    ends.first.row(s) = rows.row(0) - rows.bottomRows(n - 1).colwise().mean();
    ends.last.row(s) = rows.row(n - 1) - rows.topRows(n - 1).colwise().mean();
  }
  return ends;
}

bool starts_differ(const Ends& ends) {
  constexpr double by_chance = 0.001;
  const auto series = static_cast<double>(ends.first.rows());
  FisherSum axes;
  for (Eigen::Index k = 0; k < ends.first.cols(); ++k) {
    const double last = ends.last.col(k).squaredNorm();
    if (last > 0.0) {
      axes.add(f_upper_p(std::max(ends.first.col(k).squaredNorm() / last, 1e-12), series, series));
    }
  }
  return axes.count() > 0.0 && axes.p_value() < by_chance;
}

// Returns true if the differences of the first readings have a mean in common (Student's test for
// each axis, Bonferroni's correction). It finds a smaller transient than starts_differ() if the
// transient has the same sign in all series.
bool starts_have_a_mean(const Ends& ends) {
  constexpr double by_chance = 0.05;
  const auto series = static_cast<double>(ends.first.rows());
  double least = 1.0;
  for (const auto& of_axis : ends.first.colwise()) {
    const double mean = of_axis.mean();
    const double variance = (of_axis.array() - mean).square().sum() / (series - 1.0) / series;
    if (variance > 0.0) {
      least =
          std::min(least, f_upper_p(std::max(mean * mean / variance, 1e-12), 1.0, series - 1.0));
    }
  }
  return least * static_cast<double>(ends.first.cols()) < by_chance;
}

}  // namespace

UnsettledStart find_unsettled_start(const Eigen::MatrixXd& response,
                                    const std::vector<ReadingSeries>& series) {
  const Eigen::Index shortest =
      std::min_element(series.begin(), series.end(), [](const auto& a, const auto& b) {
        return a.readings < b.readings;
      })->readings;
  UnsettledStart start;
  for (; shortest - start.readings >= fewest_of_series - 1; ++start.readings) {
    const Ends ends = ends_of(series, response, start.readings);
    if (!starts_differ(ends) && !(start.readings > 0 && starts_have_a_mean(ends))) {
      return start;
    }
    start.largest = std::max(start.largest, ends.first.cwiseAbs().maxCoeff());
  }
  start.settles = false;
  return start;
}

}  // namespace axiscal
