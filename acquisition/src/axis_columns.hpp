// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/acquisition/source.hpp"
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

/// @return the channel of that name, or nothing.
[[nodiscard]] std::optional<std::size_t> find_channel(const std::vector<Channel>& channels,
                                                      const std::string& name);

}  // namespace axiscal
