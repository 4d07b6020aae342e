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
  std::vector<std::optional<std::size_t>>
      rows;                           ///< rows of the sheet, if there is one; otherwise empty
  std::vector<std::string> messages;  ///< seats that do not fit, with a remedy
};

/// Up at each rest of a cube by a rough calibration: the middle and half of each axis's extremes.
/// Its six directions do not determine more.
/// @param means  of an accelerometer, n x 3.
[[nodiscard]] Eigen::MatrixX3d rough_ups(const Eigen::MatrixX3d& means);

/// Writes the field of readings from the face that lay on a level table: F up, away from the face.
/// @param magnitude  F [field unit].
/// @param faces      of each reading; those without one are left as they are.
void assume_level_table(double magnitude,
                        const std::vector<std::optional<Face>>& faces,
                        Observations& observations);

/// The faces on which a cube rests, from an accelerometer in it, not calibrated: the axis that
/// reads farthest from the middle of its extremes, up being away from the face on the table.
///
/// @param means  of each rest, n x 3, in the cube's frame.
/// @return nothing for a rest that lies on an edge: its largest component is below 0.85 of 1 g.
/// @throws RefusedError  if the rests do not reach both ends of each axis.
[[nodiscard]] std::vector<std::optional<Face>> resting_faces(const Eigen::MatrixX3d& means);

/// Labels in the order of a run sheet.
///
/// Where the faces that are seen do not go with the sheet one by one, the alignment that leaves out
/// the fewest rests and rows is taken; each rest that does not fit and each row that was not found
/// has a message.
///
/// @param faces  as resting_faces().
[[nodiscard]] SeatLabels label_by_sheet(const std::vector<std::optional<Face>>& faces,
                                        const std::vector<RunSheetRow>& sheet);

/// The deviation of the rests from the poses and levels of a sheet, one by one, for any linear
/// response to any field that is constant in the table: v_i = c + M vec(level_i R_i), least squares
/// over c and M. Exchanges that such a model absorbs are not visible.
///
/// @param means  of each rest, n x m, of any columns of one instrument.
/// @param sheet  n rows.
/// @return the residuals' standard deviation relative to the largest range of a column; nullopt if
///         every order fits, because the degrees of freedom are zero.
[[nodiscard]] std::optional<double> misfit_of_order(const Eigen::MatrixXd& means,
                                                    const std::vector<RunSheetRow>& sheet);

/// Labels by a run sheet where the kind of instrument is not known. The sheet's order is trusted
/// where the rests read as its poses do in some field; else an accelerometer's faces are looked
/// for, and rests that read otherwise have a message.
///
/// @param means             of each rest, n x m.
/// @param is_accelerometer  whether the columns were said to be one's, three.
/// @throws RefusedError  if the numbers of rests and rows differ and the assignment is ambiguous.
[[nodiscard]] SeatLabels label_by_plan(const Eigen::MatrixXd& means,
                                       const std::vector<RunSheetRow>& sheet,
                                       bool is_accelerometer);

/// Labels by how the cube turned from rest to rest.
///
/// @param faces  as resting_faces().
/// @param turns  rotation from the sensor's frame at rest i + 1 to that at rest i, n - 1, as an
///               integrated gyroscope gives it.
/// @param first  of the first rest; nullopt: any, because turning the table does not change
///               coefficients.
/// @return a rest whose turn is more than 30 degrees from every label has none, and a message.
[[nodiscard]] SeatLabels label_by_turns(const std::vector<std::optional<Face>>& faces,
                                        const std::vector<Eigen::Matrix3d>& turns,
                                        const std::optional<DesignPoint>& first);

/// Labels by the horizontal direction of a second field, a magnetometer's.
///
/// @param ups     up at each rest in the cube's frame, n x 3.
/// @param fields  the second field at each rest in the cube's frame, n x 3; biases removed as far
///                as can be.
[[nodiscard]] SeatLabels label_by_heading(const std::vector<std::optional<Face>>& faces,
                                          const Eigen::MatrixX3d& ups,
                                          const Eigen::MatrixX3d& fields,
                                          const std::optional<DesignPoint>& first);

/// Labels where only the resting face is known: each face's first rest has the first of its two
/// fence faces in the standard design, the next one the second, and so on in turn.
[[nodiscard]] SeatLabels label_by_order(const std::vector<std::optional<Face>>& faces);

}  // namespace axiscal
