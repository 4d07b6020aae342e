// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/axis_columns.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/instruments/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::optional<std::size_t> find_channel(const std::vector<Channel>& channels,
                                        const std::string& name) {
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].name == name) {
      return i;
    }
  }
  return {};
}

std::size_t need_channel(const std::vector<Channel>& channels, const std::string& name) {
  if (const std::optional<std::size_t> found = find_channel(channels, name)) {
    return *found;
  }
  std::vector<std::string> there;
  for (const Channel& channel : channels) {
    there.push_back(channel.name);
  }
  throw DomainError(formatted("the sources do not have a channel '{}'; their channels are: {}. "
                              "Rename the channels with names= in the address of the source, or "
                              "rename the axes",
                              name, joined(there)),
                    {settings::axes});
}

}  // namespace

std::vector<AxisColumns> find_axes(const Instrument& instrument,
                                   const std::vector<Channel>& channels) {
  std::vector<AxisColumns> columns;
  // If the source only numbers its channels (c1, c2, ...) and there is one channel for each axis,
  // channel k is axis k.
  bool are_bare = instrument.differences.empty() && channels.size() == instrument.axes.size();
  for (std::size_t i = 0; i < channels.size(); ++i) {
    are_bare = are_bare && channels[i].name == formatted("c{}", i + 1);
  }
  if (are_bare) {
    for (std::size_t i = 0; i < channels.size(); ++i) {
      columns.push_back({.plus = i, .minus = {}});
    }
    return columns;
  }
  for (const std::string& axis : instrument.axes) {
    const auto difference =
        std::find_if(instrument.differences.begin(), instrument.differences.end(),
                     [&](const DifferentialAxis& one) { return one.axis == axis; });
    if (difference == instrument.differences.end()) {
      columns.push_back({.plus = need_channel(channels, axis), .minus = {}});
    } else {
      columns.push_back({.plus = need_channel(channels, difference->plus),
                         .minus = need_channel(channels, difference->minus)});
    }
  }
  return columns;
}

std::vector<std::size_t> find_temperatures(const Instrument& instrument,
                                           const std::vector<Channel>& channels,
                                           const std::vector<std::string>& names) {
  if (names.size() > 1) {
    if (names.size() != instrument.axes.size()) {
      throw DomainError(
          formatted("{} temperature channels are given for {} axes: give one for all axes, or one "
                    "for each axis",
                    names.size(), instrument.axes.size()));
    }
    std::vector<std::size_t> own;
    for (const std::string& name : names) {
      own.push_back(need_channel(channels, name));
    }
    return own;
  }
  if (const std::optional<std::size_t> one = find_channel(channels, names.front())) {
    return {*one};
  }
  std::vector<std::size_t> own;
  for (const std::string& axis : instrument.axes) {
    if (const auto column = find_channel(channels, axis + "_temperature")) {
      own.push_back(*column);
    }
  }
  return own.size() == instrument.axes.size() ? own : std::vector<std::size_t>();
}

std::optional<SensorTemperature> temperature_in(std::span<const double> values,
                                                const std::vector<std::size_t>& columns) {
  std::vector<double> all;
  for (const std::size_t column : columns) {
    if (!std::isfinite(values[column])) {
      return std::nullopt;
    }
    all.push_back(values[column]);
  }
  if (all.size() == 1) {
    return all.front();
  }
  return all.empty() ? std::nullopt : std::optional(SensorTemperature(std::move(all)));
}

}  // namespace axiscal
