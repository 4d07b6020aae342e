// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/run.hpp"

namespace axiscal::cli {

/// Restores the sign of counts that were printed as unsigned numbers, and leaves out readings of
/// erased memory (65535 in every axis). Prints notes.
void restore_count_signs(Run& run);

/// Averages the raw samples of an instrument that measures gravity to one reading per rest. Prints
/// a note. Readings with poses do not change.
/// @param instrument  the kind of instrument.
/// @return true if the readings of the run are now means of rests.
bool gather_rests(const std::string& instrument, Run& run);

/// Labels readings on the faces of a cube: by the file names, if there is one file per face
/// ("x_up.csv"), otherwise by the measured gravity. Prints a note. Readings in more than 8
/// orientations do not change.
/// @param run  run of a three-axis accelerometer, after gather_rests().
/// @throws RefusedError  if the faces cannot be determined, or names and gravity contradict each
///                       other.
void label_faces(Run& run);

/// Checks that the rows of a run are readings.
/// @throws RefusedError  if they are samples of an instrument that was moved.
void require_readings(const Run& run);

}  // namespace axiscal::cli
