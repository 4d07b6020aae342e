// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/calib/run.hpp"

namespace axiscal::cli {

/// Gives signed counts that were printed unsigned their sign, leaves readings of erased memory
/// (65535 in every axis) out, and says so.
void read_with_sign(Run& run);

/// Takes raw samples of an instrument that gravity alone determines as readings: those at rest in
/// one place are averaged to one. Says so. Readings with poses are left as they are.
/// @param instrument  its kind.
/// @return whether the run now holds means of rests.
bool gather_rests(const std::string& instrument, Run& run);

/// Takes readings that lie on the faces of a cube as labelled by them: by the names of the files,
/// one each face ("x_up.csv"), else by the gravity that they show. Says so. Readings in more than 8
/// orientations are left as they are.
/// @param run  of gather_rests(), of a three-axis accelerometer.
/// @throws RefusedError  if the faces cannot be told, or names and gravity contradict each other.
void label_faces(Run& run);

/// @throws RefusedError  if the readings are samples of an instrument that was moved.
void require_readings(const Run& run);

}  // namespace axiscal::cli
