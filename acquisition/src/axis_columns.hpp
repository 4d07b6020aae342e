// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/acquisition/source.hpp"
#include "axiscal/calib/sensor_temperature.hpp"
#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// The index of the channel of an axis, or of the two channels whose difference is the axis.
struct AxisColumns {
  std::size_t plus = 0;
  std::optional<std::size_t> minus;

  [[nodiscard]] double value(std::span<const double> values) const {
    return values[plus] - (minus ? values[*minus] : 0.0);
  }
};

/// @return the channels of each axis.
/// @throws DomainError  if no channel exists for an axis; the message lists the channels.
[[nodiscard]] std::vector<AxisColumns> find_axes(const Instrument& instrument,
                                                 const std::vector<Channel>& channels);

/// Finds the indices of the temperature channels.
///
/// @param names  one channel for all axes, or one channel for each axis in the order of the axes.
/// @return the indices of the named channels. If a single name is stated and no such channel
///         exists, the indices of the channels AXIS_temperature of all axes; empty if one of these
///         channels is missing.
/// @throws DomainError  if one of several named channels is missing, or if their number is neither
///                      1 nor the number of axes.
[[nodiscard]] std::vector<std::size_t> find_temperatures(const Instrument& instrument,
                                                         const std::vector<Channel>& channels,
                                                         const std::vector<std::string>& names);

/// @param columns  indices of channels, from find_temperatures().
/// @return the temperatures in a sample; nullopt if `columns` is empty or a value is not finite.
[[nodiscard]] std::optional<SensorTemperature> temperature_in(
    std::span<const double> values, const std::vector<std::size_t>& columns);

}  // namespace axiscal
