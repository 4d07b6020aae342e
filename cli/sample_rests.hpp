// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/run.hpp"

namespace axiscal::cli {

/// Gives signed counts that were printed unsigned their sign, leaves readings of erased memory
/// (65535 in every axis) out, and says so.
void restore_count_signs(Run& run);

/// Takes raw samples of an instrument that gravity alone determines as readings: those at rest in
/// one place are averaged to one. Says so. Readings with poses are left as they are.
/// @param instrument  its kind.
/// @return true if the readings of the run are now means of rests.
bool gather_rests(const std::string& instrument, Run& run);

/// Labels readings that lie on the faces of a cube: by the names of the files, one file per face
/// ("x_up.csv"), else by the gravity in them. Prints a note. Readings in more than 8 orientations
/// stay unchanged.
/// @param run  of gather_rests(), of a three-axis accelerometer.
/// @throws RefusedError  if the faces cannot be told, or names and gravity contradict each other.
void label_faces(Run& run);

/// @throws RefusedError  if the readings are samples of an instrument that was moved.
void require_readings(const Run& run);

}  // namespace axiscal::cli
