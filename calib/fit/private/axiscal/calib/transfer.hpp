// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "axiscal/calib/estimation.hpp"

namespace axiscal {

/// The directions of the fields that an instrument of one axis met, where they are fewer than
/// three: its transfer along them can be known, and nothing across.
///
/// @param design  [1, f, ..] of the readings.
/// @return orthonormal columns, frame sensor; the sensor's own axes where these span them. None for
///         other instruments, and for fields of all directions.
[[nodiscard]] Eigen::Matrix3Xd seen_directions(const ReadingSet& set,
                                               const Eigen::MatrixXd& design);

/// The transfer: the regression of the axis on the field along the directions that it met. Its
/// sensitivity across them is 0 in the estimate, and not known.
/// @param seen  as seen_directions(); at least one.
[[nodiscard]] Estimate estimate_transfer(const ReadingSet& set,
                                         const Eigen::MatrixXd& design,
                                         const Eigen::Matrix3Xd& seen);

/// Takes the parameters that were not seen out of a record's statistics and budget, and names them
/// in a note.
/// @param calibration  of the transfer, otherwise finished.
void forget_unseen(const Eigen::Matrix3Xd& seen, Calibration& calibration);

}  // namespace axiscal
