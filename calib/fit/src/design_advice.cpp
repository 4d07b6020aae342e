// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/design_advice.hpp"

#include <optional>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/instruments/settings.hpp"
#include "axiscal/positioner/design.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

Eigen::Index rank_for_advice(const Eigen::MatrixXd& matrix) {
  constexpr double worthwhile = 1e-6;  // threshold of the rank; excludes points that barely help
  return Factor(matrix, worthwhile).rank();
}

}  // namespace

RowsForPoint rows_of_points(const ReadingSet& set, const TableField& field) {
  return [&set, field](const DesignPoint& point, double level) -> Eigen::MatrixXd {
    return set.design_row(set.orientation(point), field.at(level));
  };
}

std::string points_to_add(const Eigen::MatrixXd& design,
                          const RowsForPoint& rows_for,
                          bool levels_help) {
  Eigen::MatrixXd extended = design;
  Eigen::Index rank = rank_for_advice(extended);
  std::vector<std::string> names;
  const std::vector<double> levels =
      levels_help ? std::vector<double>{1.0, -1.0, 0.0} : std::vector<double>{1.0};
  for (const double level : levels) {
    for (const DesignEntry& entry : standard_design(24)) {
      if (rank == design.cols()) {
        break;
      }
      Eigen::MatrixXd rows;
      try {
        rows = rows_for(entry.point, level);
      } catch (const RefusedError&) {
        continue;  // the cube cannot be placed at this design point
      }
      Eigen::MatrixXd longer(extended.rows() + rows.rows(), design.cols());
      longer << extended, rows;
      const Eigen::Index longer_rank = rank_for_advice(longer);
      if (longer_rank > rank) {
        rank = longer_rank;
        extended = std::move(longer);
        names.push_back(entry.point.name() +
                        (level == 1.0 ? "" : " at level " + number_text(level)));
      }
    }
  }
  return rank == design.cols() ? joined(names, "; ") : "";
}

OpenParameters open_parameters(const ReadingSet& set, const Eigen::MatrixXd& design) {
  OpenParameters open_ones{.names = {}, .seen = design};
  std::vector<std::string>& names = open_ones.names;
  // the undetermined columns for an axis that uses all rows
  std::optional<std::vector<Eigen::Index>> of_all;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    // If the rows are averages of readings, every axis uses all of them.
    const bool own_rows = design.rows() == set.size() && (set.weights.col(k).array() == 0.0).any();
    if (!own_rows && !of_all) {
      of_all = undetermined_columns(design);
    }
    if (!own_rows && of_all->empty()) {
      continue;
    }
    Eigen::MatrixXd used = design;
    for (Eigen::Index i = 0; own_rows && i < set.size(); ++i) {
      if (set.weights(i, k) == 0.0) {
        used.row(i).setZero();
      }
    }
    const std::vector<Eigen::Index> open = own_rows ? undetermined_columns(used) : *of_all;
    if (open.empty()) {
      continue;
    }
    if (names.empty()) {
      open_ones.seen = used;
      open_ones.left_out = own_rows;
    }
    const std::vector<std::string> own =
        names_of_columns({set.axes[static_cast<std::size_t>(k)]}, open, set.also_kinds);
    names.insert(names.end(), own.begin(), own.end());
  }
  return open_ones;
}

void require_determined(const ReadingSet& set,
                        const Eigen::MatrixXd& design,
                        const RowsForPoint& rows_for,
                        bool turned_round) {
  OpenParameters open = open_parameters(set, design);
  if (open.names.empty()) {
    return;
  }
  std::string advice = "add readings with the field in other directions";
  if (open.left_out) {
    advice =
        "the light reaches these axes from too few directions. Also take readings with the lamp "
        "off (level 0), take all 24 points, or place the lamp away from the table's normal and the "
        "cube's diagonal. Alternatively, define one axis as the difference of two opposite ones "
        "(for example d=p-n)";
  } else if (rows_for) {
    const std::string points = points_to_add(open.seen, rows_for, set.field.level_can_be_set());
    if (!points.empty()) {
      advice = "add readings at " + points;
      if (turned_round) {
        advice += ", each also with the opposite fence face";
      }
    }
  }
  const std::string list = joined(open.names);
  throw RankDeficientError(formatted("the readings do not determine {}; {}", list, advice),
                           std::move(open.names),
                           open.left_out ? std::vector{settings::axes} : std::vector<Setting>{});
}

}  // namespace axiscal
