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
/// Raw recordings: rests, seats, turns and noise.
///
/// A LogFile reads tables of any look, flight logs, bags and phones' recordings as a table, a
/// RecordingFile all series that they hold, a TableText tables whose cells are labels; segment()
/// finds the rests of a recording and writes them as observations; calibrate_imu() calibrates
/// accelerometer, gyroscope and magnetometer of one log in one frame; allan_deviation() and
/// fit_noise() say how long a reading is worth averaging.
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
/// - A log without times needs a rate, and says so; times in milliseconds are recognised by the
///   rate.
/// - A rest's standard deviation is of its samples; they are correlated, so its mean is known less
///   well than sd / sqrt(n).
