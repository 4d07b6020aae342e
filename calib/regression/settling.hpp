// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// Consecutive rows of a response: repeated readings of one quantity.
struct ReadingSeries {
  Eigen::Index first = 0;     ///< index of the first row
  Eigen::Index readings = 0;  ///< number of rows
};

/// The readings at the start of each series that differ from the later ones.
struct UnsettledStart {
  Eigen::Index readings = 0;  ///< number of readings to leave out of each series; 0 if none differ
  double largest = 0.0;       ///< largest difference of a first reading [unit of the response]
  bool settles = true;        ///< false if too few readings remain to show that they agree
};

/// A series with fewer readings cannot be tested.
constexpr Eigen::Index fewest_of_series = 4;
/// The test needs this number of series.
constexpr std::size_t fewest_series = 6;

/// Finds the readings at the start of each series that were taken before the instrument had
/// settled (docs/method/settling.md). The first reading of each series is compared with the mean of
/// the later ones, and the last reading with the mean of the earlier ones. Correlated noise and
/// drifts affect both differences equally. The test has the level 0.001. It is repeated without
/// the first readings while it rejects and at least three readings remain.
///
/// @param response  n x m.
/// @param series    at least fewest_series series of at least fewest_of_series readings.
[[nodiscard]] UnsettledStart find_unsettled_start(const Eigen::MatrixXd& response,
                                                  const std::vector<ReadingSeries>& series);

}  // namespace axiscal
