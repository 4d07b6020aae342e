// SPDX-License-Identifier: Apache-2.0
#include "design_advice.hpp"

#include <Eigen/QR>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/positioner/design.hpp"

namespace axiscal {
namespace {

Eigen::Index rank_of(const Eigen::MatrixXd& matrix) {
  Eigen::VectorXd scale = matrix.colwise().norm();
  scale = (scale.array() > 0.0).select(scale.cwiseInverse(), 1.0);
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(matrix * scale.asDiagonal());
  qr.setThreshold(1e-6);  // a point that determines something only just is no advice
  return qr.rank();
}

}  // namespace

std::string points_to_add(const Eigen::MatrixXd& design, const RowsForPoint& rows_for) {
  Eigen::MatrixXd extended = design;
  Eigen::Index rank = rank_of(extended);
  std::vector<std::string> names;
  for (const DesignEntry& entry : standard_design(24)) {
    if (rank == design.cols()) {
      break;
    }
    Eigen::MatrixXd rows;
    try {
      rows = rows_for(entry.point);
    } catch (const RefusedError&) {
      continue;  // the cube cannot lie so
    }
    Eigen::MatrixXd longer(extended.rows() + rows.rows(), design.cols());
    longer << extended, rows;
    const Eigen::Index longer_rank = rank_of(longer);
    if (longer_rank > rank) {
      rank = longer_rank;
      extended = std::move(longer);
      names.push_back(entry.point.name());
    }
  }
  return rank == design.cols() ? joined(names, "; ") : "";
}

void require_determined(const ReadingSet& set,
                        const Eigen::MatrixXd& design,
                        const RowsForPoint& rows_for,
                        bool turned_round) {
  const std::vector<Eigen::Index> open = undetermined_columns(design);
  if (open.empty()) {
    return;
  }
  std::vector<std::string> names = names_of_columns(set.axes, open);
  std::string advice = "add readings with the field in other directions";
  if (rows_for) {
    const std::string points = points_to_add(design, rows_for);
    if (!points.empty()) {
      advice = "add readings at " + points;
      if (turned_round) {
        advice += ", each also turned round (the opposite fence face)";
      }
    }
  }
  const std::string list = joined(names);
  throw RankDeficientError("the readings do not determine " + list + "; " + advice,
                           std::move(names));
}

}  // namespace axiscal
