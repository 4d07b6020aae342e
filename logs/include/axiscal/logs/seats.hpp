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
  std::vector<std::optional<DesignPoint>> points;  ///< one for each rest
  /// The row of the run sheet for each rest; empty without a run sheet.
  std::vector<std::optional<std::size_t>> rows;
  std::vector<std::string> messages;  ///< messages about seats that do not fit, with a remedy
};

/// Estimates the direction up at each rest of a cube by a rough calibration. The bias of an axis is
/// the middle of its extremes, and its sensitivity is half of their difference. Six directions do
/// not determine more coefficients.
/// @param means  means of an accelerometer at the rests, n x 3.
/// @return the directions up in the cube's frame, n x 3, with lengths of about 1.
[[nodiscard]] Eigen::MatrixX3d approximate_up_directions(const Eigen::MatrixX3d& means);

/// Sets the field of each reading from the face that lay on a level table. The field has the
/// magnitude F and points up, away from the face.
/// @param magnitude  F [field unit].
/// @param faces      face for each reading; a reading without a face stays unchanged.
void assume_level_table(double magnitude,
                        const std::vector<std::optional<Face>>& faces,
                        Observations& observations);

/// Finds the faces on which a cube rests, from an uncalibrated accelerometer in the cube. The
/// vertical axis is the one whose reading is farthest from the middle of its extremes. The
/// direction up points away from the face on the table.
///
/// @param means  means of the accelerometer at the rests, n x 3, in the cube's frame.
/// @return a face for each rest; nullopt if the cube lay on an edge, so that its largest component
///         of gravity is below 0.85 g.
/// @throws RefusedError  if some axis did not point both up and down.
[[nodiscard]] std::vector<std::optional<Face>> resting_faces(const Eigen::MatrixX3d& means);

/// Labels rests in the order of a run sheet.
///
/// If the faces do not match the sheet one by one, the alignment that leaves out the fewest rests
/// and rows is used. Each rest that does not fit, and each row that was not found, gets a message.
///
/// @param faces  the rest faces that resting_faces() found.
[[nodiscard]] SeatLabels label_by_sheet(const std::vector<std::optional<Face>>& faces,
                                        const std::vector<RunSheetRow>& sheet);

/// Computes how well the rests fit the poses and levels of a sheet, if rest i belongs to row i. The
/// model is v_i = c + M vec(level_i R_i). Here R_i is the rotation of the pose in row i, and c and
/// M are fitted by least squares. The model describes every linear instrument in every field that
/// is constant in the table's frame. If two rests are exchanged, but the model fits them
/// nevertheless, the exchange is not detected.
///
/// @param means  means of m columns of one instrument at the rests, n x m.
/// @param sheet  run sheet of n rows.
/// @return the residuals' standard deviation divided by the largest range of a column; nullopt if
///         the fit has no degrees of freedom, so that every order fits.
[[nodiscard]] std::optional<double> misfit_of_order(const Eigen::MatrixXd& means,
                                                    const std::vector<RunSheetRow>& sheet);

/// Labels rests by a run sheet if the kind of instrument is not known. The order of the sheet is
/// used if the rests fit its poses in some field (misfit_of_order()). Otherwise the rests are
/// labelled by the faces that an accelerometer shows, and each rest that differs from the sheet
/// gets a message.
///
/// @param means             means of m columns at the rests, n x m.
/// @param is_accelerometer  true if the three columns are known to be an accelerometer's.
/// @throws RefusedError  if the numbers of rests and rows differ and the assignment is ambiguous.
[[nodiscard]] SeatLabels label_by_plan(const Eigen::MatrixXd& means,
                                       const std::vector<RunSheetRow>& sheet,
                                       bool is_accelerometer);

/// Labels rests by the rotations of the cube between them.
///
/// @param faces  the rest faces that resting_faces() found.
/// @param turns  n - 1 rotations from the sensor's frame at rest i + 1 to its frame at rest i, as
///               an integrated gyroscope gives them.
/// @param first  label of the first rest. If it is nullopt, any label with the right rest face is
///               used, because turning the table does not change the coefficients.
/// @return labels; a rest whose turn is more than 30 degrees from every label gets a message
///         instead of a label.
[[nodiscard]] SeatLabels label_by_turns(const std::vector<std::optional<Face>>& faces,
                                        const std::vector<Eigen::Matrix3d>& turns,
                                        const std::optional<DesignPoint>& first);

/// Labels rests by the horizontal direction of a second field, which a magnetometer measures.
///
/// @param faces   from resting_faces().
/// @param ups     direction up at each rest in the cube's frame, n x 3.
/// @param fields  the second field at each rest in the cube's frame, n x 3, with the biases removed
///                as far as they are known.
/// @param first   see label_by_turns().
[[nodiscard]] SeatLabels label_by_heading(const std::vector<std::optional<Face>>& faces,
                                          const Eigen::MatrixX3d& ups,
                                          const Eigen::MatrixX3d& fields,
                                          const std::optional<DesignPoint>& first);

/// Labels rests if only their rest faces are known. Successive rests on one face get alternately
/// the two fence faces that the standard design has for this face.
[[nodiscard]] SeatLabels label_by_order(const std::vector<std::optional<Face>>& faces);

}  // namespace axiscal
