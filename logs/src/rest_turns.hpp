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

/// Extracts the gyroscope's samples between rests from a log. The log must outlive this object.
class RestTurns {
 public:
  RestTurns(const RecordedLog& log, const ImuOptions& options, double rate_hz);

  /// @return the turns between successive rests, except turns with missing samples and turns from
  ///         one recording to the next.
  /// @param between  indices of the rests between which turns are extracted, ascending.
  /// @param ups      upward vertical at each rest, in the sensor's frame, n x 3.
  [[nodiscard]] std::vector<GyroscopeTurn> turns(const Segmentation& rests,
                                                 const std::vector<std::size_t>& between,
                                                 const Eigen::MatrixX3d& ups);

  /// For each turn that turns() last returned, the indices of the rests before and after it.
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  /// Number of turns that the last call of turns() left out because samples were missing.
  std::size_t left_out = 0;

 private:
  // @return the samples `x`, in which missing samples are interpolated linearly over up to 0.1 s.
  [[nodiscard]] std::vector<double> filled(std::vector<double> x) const;
  void make_times(const RecordedLog& log, const SegmentOptions& options);
  [[nodiscard]] bool is_whole(std::size_t first, std::size_t count) const;

  double rate_hz_;
  std::vector<std::size_t> begins_;  // indices of the samples at which another recording begins
  // The three columns in the log, or copies in owned_ in which missing samples were interpolated.
  std::vector<std::span<const double>> gyroscope_;
  std::span<const double> time_s_;
  std::vector<std::vector<double>> owned_;
  std::vector<double> owned_times_;
};

}  // namespace axiscal
