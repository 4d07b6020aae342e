// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/random.hpp"
#include "axiscal/logs/allan.hpp"
#include "axiscal/logs/imu.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/logs/noise_model.hpp"
#include "axiscal/logs/recorded_sensor.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "axiscal/logs/regions.hpp"
#include "axiscal/logs/seats.hpp"
#include "axiscal/logs/segment.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/simulate_log.hpp"
#include "axiscal/logs/static_detector.hpp"
#include "axiscal/logs/table_text.hpp"
#include "axiscal/logs/text_row.hpp"
#include "axiscal/logs/time_column.hpp"

/// @file
/// Reads raw recordings, finds in them when an instrument was at rest (a "rest") or was turned, and
/// measures the noise of the instrument.
///
/// LogFile reads a table in any layout, a flight log, a ROS bag or a phone's recording as one table
/// of numbers. RecordingFile reads all series of such a file. TableText reads tables whose cells
/// are text. segment() finds the rests of a recording, and segmentation_csv() writes them as
/// observations. calibrate_imu() calibrates the accelerometer, the gyroscope and the magnetometer
/// of one log in one frame. allan_deviation() computes the Allan deviation of a sensor. From it,
/// fit_noise() finds the noise coefficients, and best_dwell() the most useful averaging time.
///
/// @code
/// axiscal::RandomStream random(1, 0);
/// std::vector<double> at_rest(20000);
/// for (double& sample : at_rest) {
///   sample = random.normal();
/// }
/// const std::vector<axiscal::AllanPoint> curve =
///     axiscal::allan_deviation(at_rest, 100.0, axiscal::octave_lengths(at_rest.size()));
/// std::printf("%.3f over 1 s\n", std::sqrt(axiscal::fit_noise(curve).deviation_at(1.0)));
/// @endcode
///
/// Traps:
/// - segment() throws a DataError if a log has no times and the caller does not state a rate.
/// - If the name of the time column states no unit, the unit is inferred from the sampling rate.
/// - The standard deviation of a rest is that of its samples. The samples are correlated, so the
///   standard error of their mean is larger than sd / sqrt(n).
