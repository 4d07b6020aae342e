// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Returns the directions in which the fields of the readings differ, if there are fewer than
/// three. The readings determine the response only along these directions.
///
/// @param field   the field; it has no vectors if each reading states its field.
/// @param design  the rows [1, f, ..] of the readings.
/// @return orthonormal columns in the sensor's frame; the sensor's own axes if these span the same
///         space. Empty if the fields differ in three directions. Also empty for several axes in a
///         cube that was not laid on the faces of each axis; the later error message then names the
///         faces to add.
[[nodiscard]] Eigen::Matrix3Xd seen_directions(const ReadingSet& set,
                                               const TableField& field,
                                               const Eigen::MatrixXd& design);

/// @param design  the rows [1, f, ..] of the readings.
/// @return the mean length of the fields at the readings, without fields of length 0.
[[nodiscard]] double mean_length_of_fields(const Eigen::MatrixXd& design);

/// Fits a transfer: the regression of each axis on the field along the directions `seen`. The
/// sensitivities across these directions are unknown, and 0 in the estimate.
/// @param seen  result of seen_directions(); at least one column.
[[nodiscard]] Estimate estimate_transfer(const ReadingSet& set,
                                         const Eigen::MatrixXd& design,
                                         const Eigen::Matrix3Xd& seen);

/// Removes the undetermined sensitivities from a record's statistics and budget, and names them in
/// a note.
/// @param calibration  the calibration by estimate_transfer(), complete except for this step.
void drop_unobserved_parameters(const Eigen::Matrix3Xd& seen, Calibration& calibration);

}  // namespace axiscal
