// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/turns.hpp"
#include "axiscal/logs/imu.hpp"

namespace axiscal {

/// The gyroscope's samples between rests. The log must outlive it.
class RestTurns {
 public:
  RestTurns(const RecordedLog& log, const ImuOptions& options, double rate_hz);

  /// The turns from rest to rest; those with missing samples are left out.
  /// @param between  which of the rests to go between, in their order.
  /// @param ups      the directions up at all rests, n x 3.
  [[nodiscard]] std::vector<GyroscopeTurn> turns(const Segmentation& rests,
                                                 const std::vector<std::size_t>& between,
                                                 const Eigen::MatrixX3d& ups);

  /// Of the last call: rests before and after each turn, and how many turns were left out.
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  std::size_t left_out = 0;

 private:
  // A few missing samples in a row, a tenth of a second, are bridged by a line.
  [[nodiscard]] std::vector<double> filled(std::vector<double> x) const;
  void make_times(const RecordedLog& log, const SegmentOptions& options);
  [[nodiscard]] bool is_whole(std::size_t first, std::size_t count) const;

  double rate_hz_;
  std::vector<std::size_t> begins_;                 // samples at which another recording begins
  std::vector<std::span<const double>> gyroscope_;  // the log's columns; owned_ has a filled copy
                                                    // if numbers are missing
  std::span<const double> time_s_;
  std::vector<std::vector<double>> owned_;
  std::vector<double> owned_times_;
};

}  // namespace axiscal
