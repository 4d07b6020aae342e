// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/positioner/cube_geometry.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/design_point.hpp"
#include "axiscal/positioner/facing.hpp"
#include "axiscal/positioner/feet.hpp"
#include "axiscal/positioner/mount.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "axiscal/positioner/seat.hpp"
#include "axiscal/positioner/surface.hpp"

/// @file
/// The positioner: a cube with the instrument, laid on a table and pushed against a fence in 24
/// orientations.
///
/// A DesignPoint states the face on the table and the face at the fence. A Positioner computes the
/// orientation of the cube at a design point, from nominal faces, measured normals, or measured
/// feet. A run sheet is a list of design points in the order of the readings.
///
/// @code
/// const axiscal::Positioner cube;  // the nominal cube
/// for (const axiscal::RunSheetRow& row :
///      axiscal::make_run_sheet(axiscal::standard_design(12), 1, 7)) {
///   const Eigen::Matrix3d lies = cube.rotation_table_from_positioner(row.entry.point);
///   std::printf("%d: x of the cube points to %.0f %.0f %.0f\n", row.run, lies(0, 0), lies(1, 0),
///               lies(2, 0));
/// }
/// @endcode
///
/// Traps:
/// - A face is named by its outward normal: with rest -Z the cube stands on its lower face.
/// - If only the normals of the faces are known and the fence face is not perpendicular to the rest
///   face, the heading has an error. If the feet are known, the heading is exact.
/// - A cube with measured feet may rock at a design point; rocking_remarks() lists these points.
