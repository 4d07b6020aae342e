// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/imu.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// A part of a log of which it is known what was done: the instrument lay still, or it was turned
/// by whole turns on the table.
struct Region {
  enum class Kind { rest, turn };
  Kind kind = Kind::rest;
  std::string name;                       ///< for messages; may be empty
  std::optional<double> start_s, end_s;   ///< from the first sample; or
  std::optional<std::size_t> start, end;  ///< samples, counted from 0; end is one past the last
  std::optional<Face> rest;               ///< the face that lay on the table
  std::optional<Face> fence;              ///< the face at the fence
  std::optional<double> turns;            ///< whole turns, positive anticlockwise from above
  bool sense_is_open = false;             ///< turns is a number of them without its sign
};

/// Reads {"format": "axiscal-regions", "version": 1, "regions": [{"kind": "rest" | "turn", "start":
/// s, "end": s, "rest": F, "fence": F, "turns": n}]}, seconds from the first sample, or
/// "start_sample", "end_sample".
/// @throws DataError  `PATH: /json/pointer: ...`.
[[nodiscard]] std::vector<Region> read_regions(const std::string& path);

/// Reads the regions that a column of a table names, as imucal's recordings have them: rows of one
/// name that follow each other are a region; x_p and x_a are rests with +x and -x up, x_rot is a
/// turn about x, of one turn in an unstated sense. Other names are left out.
/// @throws DataError  if the table has no such column, or it names no region.
[[nodiscard]] std::vector<Region> read_region_column(const std::string& path,
                                                     const std::string& column);

/// Calibrates the instruments of a log of which it is known when they rested and when they turned.
///
/// Rests with both faces are readings of the cube; with the face on the table alone that is taken
/// as level, so that its slope goes into the biases; without faces the accelerometer is calibrated
/// by method magnitude. A gyroscope's whole turns are known rotations: with v0 the mean of the
/// rests in the same attitude and T the time of the turn,
///
///     mean of v - v0 = S u 2 pi n / T,
///
/// and one linear regression over turns and rests gives bias and sensitivity.
///
/// @throws DataError     for regions outside the log, or a log without times and rate.
/// @throws RefusedError  as calibrate(); for too few regions.
/// @par Source
/// F. Ferraris, U. Grimaldi, M. Parvis, Sensors and Materials 7 (1995), for six rests and three
/// turns.
[[nodiscard]] ImuCalibration calibrate_regions(const RecordedLog& log,
                                               const std::vector<Region>& regions,
                                               const ImuOptions& options);

}  // namespace axiscal
