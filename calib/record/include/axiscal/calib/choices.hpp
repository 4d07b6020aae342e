// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "axiscal/core/export.hpp"

// The choices of an experiment, with their names in files and options. Records contain them too.
namespace axiscal {

/// The estimation method of the parameters (method.md, section 4).
enum class Method {
  paired,
  joint,
  known,
  magnitude,
  bias,
  turns,  ///< for gyroscopes that are turned between periods of rest; only for calibrate_imu()
  faces,  ///< for six faces that may be tilted; fits bias and scale to the field's magnitude
};

/// @return "paired", "joint", "known", "magnitude", "bias", "turns", "faces"; empty for nullopt.
[[nodiscard]] AXISCAL_EXPORT std::string_view method_name(std::optional<Method> method);

/// @return the method of that name, or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<Method> parse_method(std::string_view name);

/// @return the method of that name; nullopt if it is unknown or an experiment cannot choose it.
[[nodiscard]] AXISCAL_EXPORT std::optional<Method> parse_chosen_method(std::string_view name);

/// The status of a calibration.
enum class CalibrationStatus {
  ok,
  warning,  ///< usable, but read the warnings
  refused,  ///< do not use its results
};

/// @return "ok", "warning", "refused".
[[nodiscard]] AXISCAL_EXPORT std::string_view status_name(CalibrationStatus status);

/// @return the status of that name, or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<CalibrationStatus> parse_status(std::string_view name);

/// The weights of readings.
enum class Weighting {
  none,     ///< equal weights
  samples,  ///< the number of samples that were averaged
  sd,       ///< 1 / AXIS_sd^2
};

/// @return the weighting of that name ("samples", "sd", "none"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<Weighting> parse_weighting(std::string_view name);

/// @return "none", "samples", "sd".
[[nodiscard]] AXISCAL_EXPORT std::string_view weighting_name(Weighting weighting);

/// The group of readings for which one slope of the table is fitted.
enum class LevelBy {
  run,    ///< all readings
  block,  ///< the readings of one block, because the table may have moved between blocks
};

/// @return the choice of that name ("run", "block"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<LevelBy> parse_level_by(std::string_view name);

/// @return "run", "block".
[[nodiscard]] AXISCAL_EXPORT std::string_view level_by_name(LevelBy level_by);

/// The choice of a fitted term for a drift of the bias over the run.
enum class DriftSetup {
  automatic,  ///< included if the readings show a drift
  none,
  linear,
};

/// @return the choice of that name ("auto", "none", "linear"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<DriftSetup> parse_drift(std::string_view name);

/// @return "auto", "none", "linear".
[[nodiscard]] AXISCAL_EXPORT std::string_view drift_name(DriftSetup drift);

/// The choice of the scatter component "seats". It describes small random rotations of the cube:
/// each time the cube is laid down, its orientation is slightly different.
enum class SeatSetup {
  automatic,  ///< fitted for 24 readings or more
  fit,
  none,
};

/// @return the choice of that name ("auto", "fit", "none"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<SeatSetup> parse_seats(std::string_view name);

/// @return "auto", "fit", "none".
[[nodiscard]] AXISCAL_EXPORT std::string_view seats_name(SeatSetup seats);

/// The shape of the sensitivity matrix in method `magnitude`. It fixes the rotation of the sensor's
/// frame, which the readings do not determine.
enum class MagnitudeShape {
  symmetric,   ///< symmetric positive definite: the frame with the least rotation from the axes
  triangular,  ///< upper triangular: axis z senses along z of the frame (Tedaldi et al. 2014)
};

/// @return the shape of that name ("symmetric", "triangular"), or nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<MagnitudeShape> parse_shape(std::string_view name);

/// @return "symmetric", "triangular"; empty for nullopt.
[[nodiscard]] AXISCAL_EXPORT std::string_view shape_name(std::optional<MagnitudeShape> shape);

}  // namespace axiscal
