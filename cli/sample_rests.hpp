// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/run.hpp"

namespace axiscal::cli {

/// Restores the sign of counts that were printed as unsigned numbers. Removes readings of erased
/// memory (65535 in every axis). Prints notes.
void restore_count_signs(Run& run);

/// Replaces the raw samples of an instrument that measures gravity by one mean for each interval at
/// rest. Prints a note. A run whose readings have poses is not changed.
/// @param instrument  the kind of instrument.
/// @return true if the readings of the run are now means over periods at rest.
bool gather_rests(const std::string& instrument, Run& run);

/// Labels each reading with the face of the cube on the table. The faces are taken from the file
/// names if each face has its own file ("x_up.csv"), otherwise from the measured gravity. Prints a
/// note. Readings in more than 8 orientations are not changed.
/// @param run  run of a three-axis accelerometer, after gather_rests().
/// @throws RefusedError  if the faces cannot be determined, or file names and gravity give
///                       different faces.
void label_faces(Run& run);

/// Checks that each row of a run is a reading at rest.
/// @throws RefusedError  if the rows are consecutive samples of an instrument that was moved.
void require_readings(const Run& run);

}  // namespace axiscal::cli
