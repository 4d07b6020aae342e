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
  Calibration calibration;  ///< a calibration of three or more axes, with covariance
  StillnessOptions stillness;
  double dwell_s = 2.0;  ///< duration of each reading
  double alpha = 0.01;   ///< significance level of check_in_situ()
  std::vector<std::string> temperature_channels = {"temperature"};  ///< see SessionSetup
};

/// The current condition of an installed instrument.
struct HealthView {
  bool is_still = false;
  double progress = 0.0;  ///< completed part of the reading, 0 .. 1
  ReducedReading now;     ///< calibrated mean over the stillness window
  std::size_t readings = 0;
  std::optional<InSituCheck> check;  ///< check of all readings so far; nullopt without readings
};

/// Monitors an installed instrument in any pose. It takes readings at rest and applies the
/// calibration to them. It compares the residuals with the control limits in the calibration.
class HealthWatch {
 public:
  /// @throws DomainError  if Reducer or check_in_situ() does not accept the calibration.
  explicit HealthWatch(HealthWatchSetup setup);
  ~HealthWatch();
  HealthWatch(const HealthWatch&) = delete;
  HealthWatch& operator=(const HealthWatch&) = delete;

  /// @throws DomainError  if no channel exists for an axis.
  void set_channels(const std::vector<Channel>& channels);

  /// @param time_s  time of the sample; must not decrease.
  /// @param values  one value for each channel.
  void add(double time_s, std::span<const double> values);

  [[nodiscard]] const HealthView& view();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

struct HealthRun {
  std::size_t readings = 3;  ///< number of readings to take
  /// Time limit [s]. It is measured by the clock for live sources, and by the sample times for a
  /// recording.
  double patience_s = 60.0;
  std::function<void(const HealthView&)> show;   ///< called about once a second
  std::function<void(const std::string&)> warn;  ///< called with each new alarm of the sources
};

/// Feeds samples to a watch until it has enough readings, the sources end, or the time limit is
/// reached.
///
/// @return the final view of the watch.
/// @throws DomainError   if no channel exists for an axis.
/// @throws RefusedError  if the watch took no reading, because samples were missing or the
///                       instrument was never at rest.
[[nodiscard]] const HealthView& run_health_watch(HealthWatch& watch,
                                                 SampleFeed& feed,
                                                 const HealthRun& run);

}  // namespace axiscal
