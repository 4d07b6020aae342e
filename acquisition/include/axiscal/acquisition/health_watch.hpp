// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "axiscal/acquisition/sample_feed.hpp"
#include "axiscal/acquisition/source.hpp"
#include "axiscal/acquisition/stillness.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/reduction.hpp"

namespace axiscal {

struct HealthWatchSetup {
  Calibration calibration;  ///< three axes or more, with its covariance
  StillnessOptions stillness;
  double dwell_s = 2.0;  ///< how long each reading is taken
  double alpha = 0.01;   ///< as check_in_situ()
  std::vector<std::string> temperature_channels = {"temperature"};  ///< as of a session
};

/// The current condition of an installed instrument.
struct HealthView {
  bool is_still = false;
  double progress = 0.0;  ///< completed part of the reading, 0 .. 1
  ReducedReading now;     ///< result of the last moments
  std::size_t readings = 0;
  std::optional<InSituCheck> check;  ///< result of the readings so far
};

/// Watches an installed instrument in whatever pose it is: readings at rest, reduced, their
/// residuals against the control limits.
class HealthWatch {
 public:
  /// @throws DomainError  as Reducer, check_in_situ().
  explicit HealthWatch(HealthWatchSetup setup);
  ~HealthWatch();
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

  /// @throws DomainError  if an axis is not among them.
  void set_channels(const std::vector<Channel>& channels);

  /// @param time_s  not decreasing.
  /// @param values  one for each channel.
  void add(double time_s, std::span<const double> values);

  [[nodiscard]] const HealthView& view();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

struct HealthRun {
  std::size_t readings = 3;                     ///< at rest, until the verdict
  double patience_s = 60.0;                     ///< then it gives up; a recording's own times count
  std::function<void(const HealthView&)> show;  ///< called about once a second
  std::function<void(const std::string&)> warn;  ///< told what is wrong with the sources, once each
};

/// Feeds a watch until it has readings enough, its sources end, or patience does.
///
/// @return the observations and the check.
/// @throws DomainError   as HealthWatch::set_channels().
/// @throws RefusedError  if the watch did not get a reading: samples were missing, or the
///                       instrument was never at rest.
[[nodiscard]] const HealthView& run_health_watch(HealthWatch& watch,
                                                 SampleFeed& feed,
                                                 const HealthRun& run);

}  // namespace axiscal
