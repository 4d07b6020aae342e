// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Returns the directions along which the readings determine the response, if there are fewer than
/// three. These are the directions in which the fields of the readings differ.
///
/// @param field   the field. It has no vectors if each reading has its own given field.
/// @param design  the rows [1, f, ..] of the readings.
/// @return orthonormal columns in the sensor's frame. If some of the sensor's axes span the same
///         space, the columns are these axes. The result is empty if the fields differ in three
///         directions. It is also empty if there are several axes and the cube was not put on the
///         faces of each axis; a later error then names the faces to add.
[[nodiscard]] Eigen::Matrix3Xd seen_directions(const ReadingSet& set,
                                               const TableField& field,
                                               const Eigen::MatrixXd& design);

/// @param design  the rows [1, f, ..] of the readings.
/// @return the mean magnitude of the field, over the readings at which it is not 0.
[[nodiscard]] double mean_length_of_fields(const Eigen::MatrixXd& design);

/// Fits a transfer: the regression of each axis on the components of the field along the directions
/// `seen`. The sensitivities perpendicular to these directions are unknown; they are 0 in the
/// estimate.
/// @param seen  result of seen_directions(); at least one column.
[[nodiscard]] Estimate estimate_transfer(const ReadingSet& set,
                                         const Eigen::MatrixXd& design,
                                         const Eigen::Matrix3Xd& seen);

/// Removes the undetermined sensitivities from a record's statistics and budget, and names them in
/// a note.
/// @param calibration  the calibration by estimate_transfer(), complete except for this step.
void drop_unobserved_parameters(const Eigen::Matrix3Xd& seen, Calibration& calibration);

}  // namespace axiscal
