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

/// The gyroscope's samples between rests. The log must outlive this object.
class RestTurns {
 public:
  RestTurns(const RecordedLog& log, const ImuOptions& options, double rate_hz);

  /// @return the turns between successive rests, except turns with missing samples and turns from
  ///         one recording to the next.
  /// @param between  numbers of the rests between which turns are made, ascending.
  /// @param ups      the directions up at all rests, n x 3.
  [[nodiscard]] std::vector<GyroscopeTurn> turns(const Segmentation& rests,
                                                 const std::vector<std::size_t>& between,
                                                 const Eigen::MatrixX3d& ups);

  /// For each turn of the last call, the numbers of the rests before and after it.
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  /// The number of turns with missing samples that the last call has left out.
  std::size_t left_out = 0;

 private:
  // @return the samples, with gaps of up to 0.1 s filled by linear interpolation.
  [[nodiscard]] std::vector<double> filled(std::vector<double> x) const;
  void make_times(const RecordedLog& log, const SegmentOptions& options);
  [[nodiscard]] bool is_whole(std::size_t first, std::size_t count) const;

  double rate_hz_;
  std::vector<std::size_t> begins_;  // samples at which another recording begins
  // The columns of the log, or those in owned_ if numbers were missing.
  std::vector<std::span<const double>> gyroscope_;
  std::span<const double> time_s_;
  std::vector<std::vector<double>> owned_;
  std::vector<double> owned_times_;
};

}  // namespace axiscal
