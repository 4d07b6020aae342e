// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/observations.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// The orientation of each rest of a log, as far as it is known.
struct SeatLabels {
  std::vector<std::optional<DesignPoint>> points;  ///< one for each rest; nullopt if not known
  /// For each rest, the index of its row in the run sheet; empty if there is no run sheet.
  std::vector<std::optional<std::size_t>> rows;
  std::vector<std::string> messages;  ///< each names a rest or row that does not fit, and a remedy
};

/// Estimates the upward vertical at each rest of a cube by a rough calibration. The bias of an axis
/// is the midpoint between its largest and smallest mean, and its sensitivity is half of their
/// difference. Rests on six faces do not determine more coefficients.
/// @param means  means of an accelerometer at the rests, n x 3.
/// @return the upward vertical at each rest, expressed in the cube's frame, n x 3; the rows have
///         lengths of about 1.
[[nodiscard]] Eigen::MatrixX3d approximate_up_directions(const Eigen::MatrixX3d& means);

/// Sets the field of each reading from the face that lay on the table. The table is assumed to be
/// level, so the field points up, away from this face.
/// @param magnitude  magnitude of the field [field unit].
/// @param faces      face on the table for each reading; a reading without a face stays unchanged.
void assume_level_table(double magnitude,
                        const std::vector<std::optional<Face>>& faces,
                        Observations& observations);

/// Finds the faces on which a cube rests, from an uncalibrated accelerometer in the cube. The
/// vertical axis is the one with the largest component of approximate_up_directions().
///
/// @param means  means of the accelerometer at the rests, n x 3, in the cube's frame.
/// @return the face on the table for each rest; nullopt if the cube lay on an edge, so that the
///         largest component of gravity is below 0.85 g.
/// @throws RefusedError  unless each axis pointed up at some rest and down at another.
[[nodiscard]] std::vector<std::optional<Face>> resting_faces(const Eigen::MatrixX3d& means);

/// Labels rests in the order of a run sheet.
///
/// If the faces do not match the sheet one by one, rests and rows are aligned so that few of them
/// are left out. Each rest that does not fit and each row that was not found gets a message.
///
/// @param faces  the rest faces that resting_faces() found.
[[nodiscard]] SeatLabels label_by_sheet(const std::vector<std::optional<Face>>& faces,
                                        const std::vector<RunSheetRow>& sheet);

/// Computes how well the rests fit the poses and levels of a sheet under the assumption that rest i
/// belongs to row i. The model is v_i = c + M vec(level_i R_i). Here R_i is the rotation of the
/// pose in row i, v_i are the means at rest i, and c and M are fitted by least squares. The model
/// describes every linear instrument in every field that is constant in the table's frame. If the
/// model fits equally well after two rests are exchanged, the exchange is not detected.
///
/// @param means  means of the m columns of an instrument at the rests, n x m.
/// @param sheet  run sheet of n rows.
/// @return the standard deviation of the residuals, divided by the largest range of a column;
///         nullopt if the fit has no degrees of freedom, so that every order fits.
[[nodiscard]] std::optional<double> misfit_of_order(const Eigen::MatrixXd& means,
                                                    const std::vector<RunSheetRow>& sheet);

/// Labels the rests of an instrument of unknown kind by a run sheet. If the rests fit the poses of
/// the sheet in order, for some constant field (see misfit_of_order()), rest i gets the label of
/// row i. Otherwise, if the columns behave like an accelerometer, the rests are labelled by the
/// faces that it shows, and each rest that differs from the sheet gets a message.
///
/// @param means             means of m columns at the rests, n x m.
/// @param is_accelerometer  true if the columns are known to be the axes of an accelerometer.
/// @throws RefusedError  if the numbers of rests and rows differ and the assignment is ambiguous.
[[nodiscard]] SeatLabels label_by_plan(const Eigen::MatrixXd& means,
                                       const std::vector<RunSheetRow>& sheet,
                                       bool is_accelerometer);

/// Labels rests by the rotations of the cube between them.
///
/// @param faces  the rest faces that resting_faces() found.
/// @param turns  n - 1 rotations from the sensor's frame at rest i + 1 to its frame at rest i, for
///               example from an integrated gyroscope.
/// @param first  label of the first rest. If it is nullopt, any label with the correct face on the
///               table is used, because the coefficients do not depend on the heading of the table.
/// @return labels. A rest gets a message instead of a label if its attitude is more than 30 degrees
///         from that of every design point.
[[nodiscard]] SeatLabels label_by_turns(const std::vector<std::optional<Face>>& faces,
                                        const std::vector<Eigen::Matrix3d>& turns,
                                        const std::optional<DesignPoint>& first);

/// Labels rests by the horizontal direction of the magnetic field.
///
/// @param faces   the rest faces that resting_faces() found.
/// @param ups     upward vertical at each rest, expressed in the cube's frame, n x 3.
/// @param fields  the measured magnetic field at each rest in the cube's frame, n x 3. The biases
///                of the magnetometer are removed as far as they are known.
/// @param first   see label_by_turns().
[[nodiscard]] SeatLabels label_by_heading(const std::vector<std::optional<Face>>& faces,
                                          const Eigen::MatrixX3d& ups,
                                          const Eigen::MatrixX3d& fields,
                                          const std::optional<DesignPoint>& first);

/// Labels rests whose fence faces are not known. The standard design has two fence faces for
/// each rest face. Successive rests on the same face alternate between these two fence faces.
[[nodiscard]] SeatLabels label_by_order(const std::vector<std::optional<Face>>& faces);

}  // namespace axiscal
