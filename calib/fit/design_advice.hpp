// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/positioner/design_point.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// A function that returns the rows that a reading would add to a design. Its arguments are the
/// design point and the level of the field.
using RowsForPoint = std::function<Eigen::MatrixXd(const DesignPoint&, double level)>;

/// @return a function that computes the row [1, f, second fields] of a design point for a given
///         field in the table. f is the field in the sensor's frame; the second fields are those of
///         Experiment::also. `set` must outlive the function.
[[nodiscard]] RowsForPoint rows_of_points(const ReadingSet& set, const TableField& field);

/// Returns a short list of design points. With readings at these points, the design determines the
/// coefficients of all its columns.
///
/// @param levels_help  true if points at the levels -1 and 0 may be tried too.
/// @return e.g. "rest +Z, fence +X; rest -Z, fence +X"; "" if no points help.
[[nodiscard]] std::string points_to_add(const Eigen::MatrixXd& design,
                                        const RowsForPoint& rows_for,
                                        bool levels_help = false);

/// The coefficients that a design leaves undetermined. Each axis is judged by the readings that it
/// uses.
struct OpenParameters {
  std::vector<std::string> names;  // the undetermined coefficients of all axes
  Eigen::MatrixXd seen;            // the design of the first axis with undetermined coefficients
  bool left_out = false;           // true if the axis with design `seen` does not use all readings
};
[[nodiscard]] OpenParameters open_parameters(const ReadingSet& set, const Eigen::MatrixXd& design);

/// Throws if the columns [1, f, second fields] of a design leave coefficients undetermined. Each
/// axis is judged by the readings that it uses.
///
/// @param rows_for   see points_to_add(); empty if each reading has its own given field.
/// @param turned_round  true for method `paired`: for each point to add, the message also asks for
///                      the point with the opposite fence face.
/// @throws RankDeficientError  if a coefficient is undetermined; the error names the coefficients
///         of every axis and the readings to add.
void require_determined(const ReadingSet& set,
                        const Eigen::MatrixXd& design,
                        const RowsForPoint& rows_for,
                        bool turned_round = false);

}  // namespace axiscal
