// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/positioner/design_point.hpp"
#include "estimation.hpp"

namespace axiscal {

/// The rows that taking a design point would add to a design.
using RowsForPoint = std::function<Eigen::MatrixXd(const DesignPoint&)>;

/// A short list of points that, added one after another, make a design determine all its columns.
///
/// @return e.g. "rest +Z, fence +X; rest -Z, fence +X"; "" where no points help.
[[nodiscard]] std::string points_to_add(const Eigen::MatrixXd& design,
                                        const RowsForPoint& rows_for);

/// Refuses a design whose columns [1, f] leave coefficients open.
///
/// @param rows_for   as above; empty where readings bring their field.
/// @param turned_round  whether each point must be taken turned round as well (`paired`).
/// @throws RankDeficientError  naming the open coefficients of every axis and what to add.
void require_determined(const ReadingSet& set,
                        const Eigen::MatrixXd& design,
                        const RowsForPoint& rows_for,
                        bool turned_round = false);

}  // namespace axiscal
