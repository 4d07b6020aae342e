// SPDX-License-Identifier: Apache-2.0
#include "typed_values.hpp"

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"

namespace axiscal::cli {

double number_of(std::string_view option, const std::string& text) {
  const std::optional<double> number = parse_number(text);
  if (!number) {
    throw UsageError(formatted("{}: '{}' is not a number", option, text));
  }
  return *number;
}

std::vector<double> numbers_of(std::string_view option,
                               const std::string& text,
                               std::size_t count) {
  const std::optional<std::vector<double>> numbers = parse_numbers(text);
  if (!numbers || numbers->size() != count) {
    throw UsageError(
        formatted("{}: '{}' must be {} numbers separated by commas", option, text, count));
  }
  return *numbers;
}

ReadingRange range_of(std::string_view option, const std::string& text) {
  const std::vector<double> ends = numbers_of(option, text, 2);
  if (!(ends[0] < ends[1])) {
    throw UsageError(formatted("{}: '{}' must be LO,HI with LO less than HI", option, text));
  }
  return {.low = ends[0], .high = ends[1]};
}

double parse_positive(std::string_view option, const std::string& text) {
  const double value = number_of(option, text);
  if (!(value > 0.0)) {
    throw UsageError(formatted("{}: '{}' must be greater than 0", option, text));
  }
  return value;
}

double parse_nonnegative(std::string_view option, const std::string& text) {
  const double value = number_of(option, text);
  if (value < 0.0) {
    throw UsageError(formatted("{}: '{}' must be 0 or greater", option, text));
  }
  return value;
}

int parse_whole_number(std::string_view option, const std::string& text, int least) {
  const std::optional<int> value = parse_integer(text);
  if (!value || *value < least) {
    throw UsageError(formatted("{}: '{}' must be a whole number, {} or more", option, text, least));
  }
  return *value;
}

PitchFormula pitch_formula_of(std::string_view option, const std::string& text) {
  if (text != "asin" && text != "atan2") {
    throw UsageError(formatted("{}: must be 'asin' or 'atan2', not '{}'", option, text));
  }
  return text == "atan2" ? PitchFormula::arctangent : PitchFormula::arcsine;
}

Tolerances tolerances_of(const std::string& text) {
  Tolerances tolerances;
  for (const std::string_view item : split(text, ',')) {
    const std::size_t parting = item.find('=');
    const std::string name(item.substr(0, parting));
    double* value = name == "foot_height_m"    ? &tolerances.foot_height_m
                    : name == "ball_radius_m"  ? &tolerances.ball_radius_m
                    : name == "squareness_rad" ? &tolerances.squareness_rad
                    : name == "fence_rad"      ? &tolerances.fence_rad
                                               : nullptr;
    if (value == nullptr || parting == std::string_view::npos) {
      throw UsageError(
          formatted("--tolerances: '{}' must be NAME=SD; the names are foot_height_m, "
                    "ball_radius_m, squareness_rad, fence_rad",
                    item));
    }
    *value = parse_nonnegative("--tolerances", std::string(item.substr(parting + 1)));
  }
  return tolerances;
}

World world_of_option(const std::string& text) {
  if (text.find('=') == std::string::npos) {
    return read_world(text);
  }
  try {
    return world_of(text);
  } catch (const DomainError& error) {
    throw UsageError("--world", error);
  }
}

Site site_of_options(const std::optional<std::string>& latitude,
                     const std::optional<std::string>& longitude,
                     const std::optional<std::string>& height,
                     Site otherwise) {
  Site site = otherwise;
  if (latitude) {
    site.latitude_deg = number_of("--latitude", *latitude);
  }
  if (longitude) {
    site.longitude_deg = number_of("--longitude", *longitude);
  }
  if (height) {
    site.height_m = number_of("--height", *height);
  }
  try {
    check_site(site);
  } catch (const DomainError& error) {
    throw UsageError(error.what());
  }
  return site;
}

double date_of_option(const std::string& text) {
  const std::optional<double> time_s = parse_date(text);
  if (!time_s) {
    throw UsageError(formatted("--date: '{}' is neither ISO 8601 nor a decimal year", text));
  }
  return *time_s;
}

std::string calibrated_of_option(const std::string& text) {
  const std::optional<double> time_s = parse_timestamp(text);
  if (!time_s) {
    throw UsageError(formatted(
        "--calibrated: '{}' is not a date of the form 2026-11-20 or 2026-11-20T20:04:54Z", text));
  }
  constexpr std::size_t date_alone = 10;
  return text.size() == date_alone ? text : timestamp_of(*time_s);
}

Eigen::Vector2d slope_of_option(const std::string& text) {
  const std::vector<double> numbers = numbers_of("--slope", text, 2);
  const Eigen::Vector2d slope(numbers[0], numbers[1]);
  if (!(slope.norm() < 1.0)) {
    throw UsageError("--slope: X^2 + Y^2 must be less than 1");
  }
  return slope;
}

Method method_of_option(const std::string& text) {
  const std::optional<Method> method = parse_chosen_method(text);
  if (!method) {
    throw UsageError(
        formatted("--method: '{}' is unknown. Give paired, joint, known, faces, magnitude, bias or "
                  "attitude",
                  text));
  }
  return *method;
}

DriftSetup drift_of_option(const std::string& text) {
  const std::optional<DriftSetup> drift = parse_drift(text);
  if (!drift) {
    throw UsageError(formatted("--drift: must be 'auto', 'none' or 'linear', not '{}'", text));
  }
  return *drift;
}

SeatSetup seats_of_option(const std::string& text) {
  const std::optional<SeatSetup> seats = parse_seats(text);
  if (!seats) {
    throw UsageError(formatted("--seats: must be 'auto', 'fit' or 'none', not '{}'", text));
  }
  return *seats;
}

LevelBy levelness_scope_of_option(const std::string& text) {
  const std::optional<LevelBy> level_by = parse_level_by(text);
  if (!level_by) {
    throw UsageError(formatted("--level-by: must be 'run' or 'block', not '{}'", text));
  }
  return *level_by;
}

}  // namespace axiscal::cli
