// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/positioner/design_point.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The rows that taking a design point at a level would add to a design.
using RowsForPoint = std::function<Eigen::MatrixXd(const DesignPoint&, double level)>;

/// Rows [1, f, second fields] for the fields in the table.
[[nodiscard]] RowsForPoint rows_of_points(const ReadingSet& set, const TableField& field);

/// A short list of points that, added one after another, make a design determine all its columns.
///
/// @param levels_help  whether points at levels -1 and 0 may be tried too.
/// @return e.g. "rest +Z, fence +X; rest -Z, fence +X"; "" where no points help.
[[nodiscard]] std::string points_to_add(const Eigen::MatrixXd& design,
                                        const RowsForPoint& rows_for,
                                        bool levels_help = false);

/// The coefficients that a design leaves undetermined. Each axis is judged by the readings that it
/// uses.
struct OpenParameters {
  std::vector<std::string> names;  // all axes' coefficients; empty: none
  Eigen::MatrixXd seen;            // the design of the first axis that it leaves open
  bool left_out = false;           // whether that axis leaves readings out
};
[[nodiscard]] OpenParameters open_parameters(const ReadingSet& set, const Eigen::MatrixXd& design);

/// Refuses a design whose columns [1, f, second fields] leave coefficients open, for an axis by the
/// readings that it uses.
///
/// @param rows_for   as above; empty where readings bring their field.
/// @param turned_round  whether each point must be taken turned round as well (`paired`).
/// @throws RankDeficientError  if a coefficient is undetermined; the error names the coefficients
///         of every axis and the readings to add.
void require_determined(const ReadingSet& set,
                        const Eigen::MatrixXd& design,
                        const RowsForPoint& rows_for,
                        bool turned_round = false);

}  // namespace axiscal
