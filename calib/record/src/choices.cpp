// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/choices.hpp"

#include <array>

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 3> status_names = {"ok", "warning", "refused"};
constexpr std::array<std::string_view, 3> weighting_names = {"none", "samples", "sd"};
constexpr std::array<std::string_view, 2> level_by_names = {"run", "block"};
constexpr std::array<std::string_view, 3> drift_names = {"auto", "none", "linear"};
constexpr std::array<std::string_view, 3> seat_names = {"auto", "fit", "none"};
constexpr std::array<std::string_view, 2> shape_names = {"symmetric", "triangular"};

template <typename Enum, std::size_t Size>
std::optional<Enum> find_in(const std::array<std::string_view, Size>& names,
                            std::string_view name) {
  for (std::size_t i = 0; i < Size; ++i) {
    if (names[i] == name) {
      return static_cast<Enum>(i);
    }
  }
  return std::nullopt;
}

}  // namespace

std::string_view status_name(CalibrationStatus status) {
  return status_names[static_cast<std::size_t>(status)];
}

std::optional<CalibrationStatus> parse_status(std::string_view name) {
  return find_in<CalibrationStatus>(status_names, name);
}

std::string_view weighting_name(Weighting weighting) {
  return weighting_names[static_cast<std::size_t>(weighting)];
}

std::optional<Weighting> parse_weighting(std::string_view name) {
  return find_in<Weighting>(weighting_names, name);
}

std::optional<DriftSetup> parse_drift(std::string_view name) {
  return find_in<DriftSetup>(drift_names, name);
}

std::optional<SeatSetup> parse_seats(std::string_view name) {
  return find_in<SeatSetup>(seat_names, name);
}

std::optional<LevelBy> parse_level_by(std::string_view name) {
  return find_in<LevelBy>(level_by_names, name);
}

std::optional<MagnitudeShape> parse_shape(std::string_view name) {
  return find_in<MagnitudeShape>(shape_names, name);
}

std::string_view shape_name(std::optional<MagnitudeShape> shape) {
  return shape ? shape_names[static_cast<std::size_t>(*shape)] : std::string_view();
}

std::string_view level_by_name(LevelBy level_by) {
  return level_by_names[static_cast<std::size_t>(level_by)];
}

std::string_view drift_name(DriftSetup drift) {
  return drift_names[static_cast<std::size_t>(drift)];
}

std::string_view seats_name(SeatSetup seats) {
  return seat_names[static_cast<std::size_t>(seats)];
}

}  // namespace axiscal
