// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>
#include <vector>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/positioner/design.hpp"
#include "calib/fit/design_advice.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/response_system.hpp"
#include "calib/fit/src/joint_solution.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the rows that a reading at another design point would add to the Jacobian. The slope of
// the table is that of the first block.
Eigen::MatrixXd jacobian_rows(const ReadingSet& set,
                              const JointSolution& solution,
                              const DesignPoint& point,
                              double level) {
  ReadingSet one = set;
  one.readings = {Reading{.block = set.field.blocks().front(), .point = point, .level = level}};
  one.response = Eigen::MatrixXd::Zero(1, set.axis_count());
  one.rotation_sensor_from_table = {set.orientation(point)};
  one.field_then.clear();                        // use the field at the mean time
  one.temperature.d = Eigen::VectorXd::Zero(1);  // use the reference temperature
  one.effects.columns = Eigen::MatrixXd::Zero(1, set.effects.columns.cols());
  one.effects.memory.resize(0, 0);
  const Solution& state = *solution.state;
  const Eigen::MatrixXd base = field_design(one, state.field());
  const FieldChanges changes = field_direction_derivatives(one, state.field(), state.tangents);
  std::vector<Eigen::MatrixXd> own;
  std::vector<Eigen::MatrixXd> shared;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::VectorXd& estimate = state.axes[static_cast<std::size_t>(k)].estimate;
    own.emplace_back(one.all_columns(base, k) / solution.sigma(k));
    shared.emplace_back(response_changes(one, k, estimate.segment<3>(1).transpose(), changes) /
                        solution.sigma(k));
  }
  return stacked_by_axis(own, shared);
}

}  // namespace

void require_direction(const Fit& run, const JointSolution& solution) {
  const ReadingSet& set = run.set();
  const Eigen::MatrixXd J = run.columns();
  const Eigen::Index parameters = J.cols();
  std::vector<Eigen::Index> open;
  if (J.rows() >= parameters) {
    open = confounded_columns(J, Model::open_below, 1e-6);
    if (open.empty()) {
      return;
    }
  } else {
    open = undetermined_columns(J);
  }
  std::vector<std::string> names = undetermined_column_names(open, run.names());
  const std::string points = points_to_add(
      J,
      [&](const DesignPoint& point, double level) {
        return jacobian_rows(set, solution, point, level);
      },
      set.field.is_sum());
  std::vector<Setting> settings = {settings::method};
  if (points.empty() && !set.also_in_table.empty()) {
    settings.insert(settings.end(),
                    {settings::site, settings::fence_azimuth, settings::field_table});
  }
  std::string advice =
      formatted("add readings at {}, or use the method 'known' if the table is level", points);
  if (points.empty()) {
    advice = set.also_in_table.empty()
                 ? "repeat the reading on each rest face with the opposite face at the fence, or "
                   "use the method 'known' if the table is level"
                 : "use the method 'known' and give the field's direction (the site and the "
                   "fence's azimuth, or the field's vector in the table's frame)";
  }
  const std::string why = formatted("the readings do not determine {}{}; {}", joined(names),
                                    names.size() > 1 ? " together" : "", advice);
  throw RankDeficientError(why, std::move(names), std::move(settings));
}

void require_degrees_of_freedom(const ReadingSet& set, const JointSolution& solution) {
  std::vector<std::string> axes;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    if (solution.shares.degrees_of_freedom(k) < 0.5) {
      axes.push_back(set.axes[static_cast<std::size_t>(k)]);
    }
  }
  if (axes.empty()) {
    return;
  }
  std::vector<std::string> points;
  for (const DesignEntry& entry : standard_design(12)) {
    const bool taken = std::any_of(set.readings.begin(), set.readings.end(),
                                   [&](const Reading& r) { return r.point == entry.point; });
    if (!taken && points.size() < 4) {
      points.push_back(entry.point.name());
    }
  }
  std::vector<std::string> names = parameter_names(axes, set.also_kinds, set.temperature.order);
  const std::string list = joined(names);
  throw RankDeficientError(
      formatted(
          "there are too few readings to determine {} together with the field's direction and to "
          "check the fit; add readings{}, or use the method 'known' if the table is level",
          list, points.empty() ? "" : " at " + joined(points, "; ")),
      std::move(names), {settings::method});
}

}  // namespace axiscal
