// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/imu.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// A part of a log in which the instrument is known to have lain still, or to have been turned by
/// whole turns on the table.
struct Region {
  enum class Kind { rest, turn };
  Kind kind = Kind::rest;
  std::string name;                       ///< name of the region, for messages; may be empty
  std::optional<double> start_s, end_s;   ///< times after the first sample [s]; replace start, end
  std::optional<std::size_t> start, end;  ///< numbers of samples from 0; end is one past the last
  std::optional<Face> rest;               ///< the face that lay on the table
  std::optional<Face> fence;              ///< the face at the fence
  std::optional<double> turns;            ///< whole turns; positive if anticlockwise from above
  bool sense_is_open = false;             ///< true if the sign of `turns` is not known
};

/// Reads {"format": "axiscal-regions", "version": 1, "regions": [{"kind": "rest" | "turn", "start":
/// s, "end": s, "rest": F, "fence": F, "turns": n}]}. "start" and "end" are seconds after the first
/// sample. The numbers of samples "start_sample" and "end_sample" may replace them.
/// @throws DataError  with the message `PATH: /json/pointer: ...`.
[[nodiscard]] std::vector<Region> read_regions(const std::string& path);

/// Reads regions from a column of names in a table, as in imucal's recordings. Successive rows with
/// the same name are one region. "x_p" is a rest with +x up, "x_a" is a rest with -x up, and
/// "x_rot" is one turn about x whose sense is not known. Rows with other names are ignored.
/// @throws DataError  if the table does not have the column, or none of its cells names a region.
[[nodiscard]] std::vector<Region> read_region_column(const std::string& path,
                                                     const std::string& column);

/// Calibrates the instruments of a log whose rests and turns are known.
///
/// The accelerometer is calibrated from the rests. If both faces of all rests are stated, the rests
/// are readings of the cube. If only the faces on the table are stated, the table is assumed to be
/// level, so that its slope becomes part of the biases. If no faces are stated, the method is
/// magnitude. The gyroscope is calibrated from the whole turns, whose rotations are known:
///
///     mean of v - v0 = S u 2 pi n / T
///
/// Here v are the readings during the turn, v0 is their mean over the rests in the same attitude, S
/// is the sensitivity, u is up in the cube's frame, n is the number of turns, and T is the duration
/// of the turn. One linear regression over turns and rests gives the bias and S.
///
/// @throws DataError     if a region is outside the log, or the log has neither times nor a rate.
/// @throws RefusedError  if there is no rest, or for the reasons of calibrate().
/// @par Source
/// F. Ferraris, U. Grimaldi, M. Parvis, Sensors and Materials 7 (1995), for six rests and three
/// turns.
[[nodiscard]] ImuCalibration calibrate_regions(const RecordedLog& log,
                                               const std::vector<Region>& regions,
                                               const ImuOptions& options);

}  // namespace axiscal
