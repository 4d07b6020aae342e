// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/imu.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// A part of a log in which the instrument is known to have been at rest, or to have been turned on
/// the table by a whole number of turns.
struct Region {
  enum class Kind { rest, turn };
  Kind kind = Kind::rest;
  std::string name;  ///< name of the region, for messages; may be empty
  /// Start and end of the region [s since the first sample]; an alternative to `start` and `end`.
  std::optional<double> start_s, end_s;
  std::optional<std::size_t> start, end;  ///< zero-based sample numbers; end is one past the last
  std::optional<Face> rest;               ///< the face that lay on the table
  std::optional<Face> fence;              ///< the face at the fence
  std::optional<double> turns;            ///< number of turns; anticlockwise from above is positive
  bool sense_is_open = false;             ///< true if the direction of the turns is not known
};

/// Reads regions from a JSON file: {"format": "axiscal-regions", "version": 1, "regions": [{"kind":
/// "rest" | "turn", "start": s, "end": s, "rest": F, "fence": F, "turns": n}]}. F is a face such as
/// "+X". "start" and "end" are seconds since the first sample. The sample numbers "start_sample"
/// and "end_sample" may be given instead.
/// @throws DataError  with the message `PATH: /json/pointer: ...`.
[[nodiscard]] std::vector<Region> read_regions(const std::string& path);

/// Reads regions from a column of names in a table; the library imucal uses such names.
/// Successive rows with the same name are one region. "x_p" is a rest with +x up, "x_a" is a rest
/// with -x up, and "x_rot" is one turn about x in an unknown direction. Rows with other names are
/// ignored.
/// @throws DataError  if the table does not have the column, or none of its cells names a region.
[[nodiscard]] std::vector<Region> read_region_column(const std::string& path,
                                                     const std::string& column);

/// Calibrates the instruments of a log whose rests and turns are known.
///
/// The accelerometer is calibrated from the rests. If the faces on the table and at the fence are
/// stated for all rests, the means of the rests are used like readings of an instrument in a cube.
/// If only the faces on the table are stated, the table is assumed to be level; its actual slope
/// then causes errors of the biases. If no faces are stated, the method `magnitude` is used. The
/// gyroscope is calibrated from the turns, whose angles are known:
///
///     mean of v - v0 = S u 2 pi n / T
///
/// Here v are the gyroscope's readings during the turn, v0 is their mean over the rests in the same
/// attitude, S is the sensitivity, u is the upward vertical in the cube's frame, n is the number of
/// turns, and T is the duration of the turn. A linear regression over all turns and rests gives the
/// bias and S.
///
/// @throws DataError     if a region is outside the log, or the log has neither times nor a rate.
/// @throws RefusedError  if there is no rest, or if calibrate() throws it.
/// @par Source
/// F. Ferraris, U. Grimaldi, M. Parvis, Sensors and Materials 7 (1995), for six rests and three
/// turns.
[[nodiscard]] ImuCalibration calibrate_regions(const RecordedLog& log,
                                               const std::vector<Region>& regions,
                                               const ImuOptions& options);

}  // namespace axiscal
