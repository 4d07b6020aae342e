// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

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
  std::string temperature_channel = "temperature";
};

/// What an installed instrument says right now.
struct HealthView {
  bool is_still = false;
  double progress = 0.0;  ///< of the reading that is being taken, 0 .. 1
  ReducedReading now;     ///< of the last moments
  std::size_t readings = 0;
  std::optional<InSituCheck> check;  ///< of the readings so far
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

}  // namespace axiscal
