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

/// Where an axis comes from: a channel, or the difference of two.
struct AxisColumns {
  std::size_t plus = 0;
  std::optional<std::size_t> minus;

  [[nodiscard]] double value(std::span<const double> values) const {
    return values[plus] - (minus ? values[*minus] : 0.0);
  }
};

/// @throws DomainError  if an axis is not among the channels; the message lists what there is.
[[nodiscard]] std::vector<AxisColumns> find_axes(const Instrument& instrument,
                                                 const std::vector<Channel>& channels);

/// Where what temperature sensors say comes from.
///
/// @param names  of one channel for all axes, or one for each axis in their order.
/// @return these channels; if none exists, AXIS_temperature of all axes; otherwise empty.
/// @throws DomainError  if only some of several are there, or they are not as many as the axes.
[[nodiscard]] std::vector<std::size_t> find_temperatures(const Instrument& instrument,
                                                         const std::vector<Channel>& channels,
                                                         const std::vector<std::string>& names);

/// @param columns  as find_temperatures().
/// @return their values in a sample; nullopt without such channels, or if a value is not a number.
[[nodiscard]] std::optional<SensorTemperature> temperature_in(
    std::span<const double> values, const std::vector<std::size_t>& columns);

}  // namespace axiscal
