// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"

namespace axiscal {

/// The directions in which the fields of the readings differ, if they are fewer than three: the
/// response along them can be known, and none across.
///
/// @param field   without vectors if the readings bring their fields.
/// @param design  [1, f, ..] of the readings.
/// @return orthonormal columns, frame sensor; the sensor's own axes if these span them. None for
///         fields of all directions, and for a cube on which several axes lack faces of their own:
///         there the refusal names the faces to add.
[[nodiscard]] Eigen::Matrix3Xd seen_directions(const ReadingSet& set,
                                               const TableField& field,
                                               const Eigen::MatrixXd& design);

/// @param design  [1, f, ..] of the readings.
/// @return the mean length of the fields that readings met; those at rest, of length 0, do not
/// count.
[[nodiscard]] double mean_length_of_fields(const Eigen::MatrixXd& design);

/// The transfer: the regression of each axis on the field along the directions that it met. The
/// sensitivities across them are 0 in the estimate, and not known.
/// @param seen  as seen_directions(); at least one.
[[nodiscard]] Estimate estimate_transfer(const ReadingSet& set,
                                         const Eigen::MatrixXd& design,
                                         const Eigen::Matrix3Xd& seen);

/// Takes the parameters that were not seen out of a record's statistics and budget, and names them
/// in a note.
/// @param calibration  of the transfer, otherwise finished.
void drop_unobserved_parameters(const Eigen::Matrix3Xd& seen, Calibration& calibration);

}  // namespace axiscal
