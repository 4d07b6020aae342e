// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "axiscal/calib/settings.hpp"
#include "axiscal/core/error.hpp"
#include "calib/fit/design_advice.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/method_fit.hpp"
#include "calib/fit/src/axis_regression.hpp"
#include "calib/fit/src/groups.hpp"
#include "calib/fit/src/opposite_pairs.hpp"

namespace axiscal {
namespace {

// Smallest accepted component of the field along the table's normal, as a fraction of the field's
// magnitude. The average of two opposite positions (opposite fence faces) contains only this
// component, so a small component makes the relative errors large.
constexpr double smallest_normal_part = 0.05;
constexpr const char* in_plane_message =
    "method 'paired': the field lies almost in the table's plane, so it cancels in averages of "
    "opposite positions; use the method 'joint'";

// The pseudo-observations. Each one pools the pairs with the same rest face, block, soak level and
// field level.
class Pooled {
 public:
  explicit Pooled(const std::vector<OppositePair>& pairs)
      : pairs_(pairs), groups_(pairs.size(), [&](std::size_t q) {
          const OppositePair& pair = pairs[q];
          return std::tuple(pair.block, pair.soak, pair.point.rest(), pair.level);
        }) {}

  [[nodiscard]] std::size_t size() const { return groups_.size(); }

  // Returns the first pair of a pseudo-observation.
  [[nodiscard]] const OppositePair& front(std::size_t pseudo) const {
    return pairs_[groups_[pseudo].front()];
  }

  template <typename Function>
  void for_pairs(std::size_t pseudo, const Function& function) const {
    for (const std::size_t q : groups_[pseudo]) {
      function(pairs_[q]);
    }
  }

 private:
  const std::vector<OppositePair>& pairs_;
  Groups groups_;
};

RegressionRows rows_of(const Pooled& pooled, const ReadingSet& set) {
  RegressionRows rows{.rows = {},
                      .group = Groups(pooled.size(),
                                      [&](std::size_t q) {
                                        const OppositePair& first = pooled.front(q);
                                        return std::tuple(first.point.rest(), first.soak,
                                                          first.level);
                                      })
                                   .numbers(),
                      .laying = {}};
  rows.rows.reserve(pooled.size());
  for (std::size_t q = 0; q < pooled.size(); ++q) {
    const OppositePair& first = pooled.front(q);
    RegressionRow& row = rows.rows.emplace_back(
        RegressionRow{.runs = {}, .point = first.point, .block = first.block});
    pooled.for_pairs(q, [&](const OppositePair& pair) {
      row.runs.reserve(row.runs.size() + pair.first.size() + pair.second.size());
      for (const auto& readings : {pair.first, pair.second}) {
        for (const std::size_t i : readings) {
          row.runs.push_back(set.readings[i].run);
        }
      }
    });
  }
  return rows;
}

// Design, responses and weights of axes that have the same columns and weights. The weights
// determine how the pairs of a face are pooled.
struct AxesData {
  Eigen::Index first = 0;  // index of the first axis
  Eigen::MatrixXd design;
  Eigen::MatrixXd responses;  // a column for each axis
  Eigen::VectorXd weights;
  std::shared_ptr<const FactoredDesign> factored;
};

// Returns the design row of a pair. If the design has further columns, for example for temperature
// or drift, this is the mean of the design rows of the pair's readings. Otherwise it is the row for
// the mean rotation of the pair.
Eigen::RowVectorXd row_of_pair(const ReadingSet& set,
                               const OppositePair& pair,
                               Eigen::Index axis,
                               const Eigen::Vector3d& field) {
  if (set.column_count() == set.base_column_count()) {
    return set.design_row(pair.mean_rotation, field);
  }
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(set.column_count());
  for (const auto& readings : {pair.first, pair.second}) {
    double sum = 0.0;
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(set.column_count());
    for (const std::size_t i : readings) {
      const auto at = static_cast<Eigen::Index>(i);
      const double weight = set.weights(at, axis);
      sum += weight;
      mean += weight * set.all_columns(set.design_row(set.met_of_field(i), field), at, axis);
    }
    row += sum > 0.0 ? Eigen::RowVectorXd(0.5 / sum * mean) : mean;
  }
  return row;
}

// Returns the data of axis `first` and of the following axes with the same columns and weights.
AxesData axes_data(const ReadingSet& set,
                   const Pooled& pooled,
                   Eigen::Index first,
                   const TableField& field) {
  const auto n = static_cast<Eigen::Index>(pooled.size());
  const Eigen::Index count = set.end_of_alike(first, set.weights) - first;
  AxesData data{.first = first,
                .design = Eigen::MatrixXd::Zero(n, set.column_count()),
                .responses = Eigen::MatrixXd::Zero(n, count),
                .weights = Eigen::VectorXd::Zero(n),
                .factored = nullptr};
  for (Eigen::Index i = 0; i < n; ++i) {
    pooled.for_pairs(static_cast<std::size_t>(i), [&](const OppositePair& pair) {
      const double weight = pair.weights(first);
      data.weights(i) += weight;
      data.responses.row(i) += weight * pair.mean.segment(first, count).transpose();
      data.design.row(i) +=
          weight *
          row_of_pair(set, pair, first, pair.level.of_all() * field.vector(pair.levelness));
    });
    if (data.weights(i) > 0.0) {
      data.responses.row(i) /= data.weights(i);
      data.design.row(i) /= data.weights(i);
    }
  }
  return data;
}

// Returns the data of all axes, with the factorisations of their designs.
std::vector<AxesData> all_axes_data(const ReadingSet& set,
                                    const Pooled& pooled,
                                    const TableField& field) {
  std::vector<AxesData> all;
  for (Eigen::Index first = 0; first < set.axis_count(); first += all.back().responses.cols()) {
    AxesData& data = all.emplace_back(axes_data(set, pooled, first, field));
    data.factored = std::make_shared<const FactoredDesign>(
        data.design, data.weights, [&] { return set.names_of_axis(data.first); });
  }
  return all;
}

std::vector<AxisRegression> regressions_of(const ReadingSet& set, const AxesData& data) {
  return regress({.set = set,
                  .first = data.first,
                  .factored = *data.factored,
                  .design = data.design,
                  .weights = data.weights,
                  .responses = data.responses,
                  .names = [&](Eigen::Index k) { return set.names_of_axis(k); }});
}

// Returns the estimated coefficients of the r axes, p x r.
Eigen::MatrixXd estimates_of(const ReadingSet& set, const AxesData& data) {
  if (!set.robust) {
    return data.factored->estimates(data.responses);
  }
  Eigen::MatrixXd estimates(data.design.cols(), data.responses.cols());
  const std::vector<AxisRegression> axes = regressions_of(set, data);
  for (Eigen::Index k = 0; k < estimates.cols(); ++k) {
    estimates.col(k) = axes[static_cast<std::size_t>(k)].fit.estimate;
  }
  return estimates;
}

// Returns the field, rotated by the measured slope. Its magnitude remains F.
TableField turned_by(const Levelness& levelness, double F, const TableField& field) {
  std::vector<Eigen::Vector3d> turned;
  for (std::size_t s = 0; s < field.size(); ++s) {
    const Eigen::Vector2d in_plane = levelness.of_block_at(s);
    const Eigen::Vector3d measured(F * in_plane.x(), F * in_plane.y(), field.vector(s).z());
    turned.emplace_back(F * measured.normalized());
  }
  return field.with(std::move(turned));
}

// Returns the largest change of a temperature scale over the temperatures of the run, relative to
// the response.
double change_of_scale(const ReadingSet& set, const Estimate& estimate) {
  double change = 0.0;
  for (int j = 0; j < set.temperature.order; ++j) {
    const double span = std::pow(set.temperature.d.cwiseAbs().maxCoeff(), j + 1);
    change = std::max(
        change,
        span * (estimate.temperature.scale - set.temperature.scale).col(j).cwiseAbs().maxCoeff());
  }
  return change;
}

}  // namespace

PairedDesign paired_design(const ReadingSet& set, const Eigen::Vector3d& in_table) {
  const OppositePairs opposites = find_opposite_pairs(set);
  const Pooled pooled(opposites.pairs);
  const AxesData data = axes_data(set, pooled, 0, set.field.with_all(in_table));
  PairedDesign paired{.design = data.design,
                      .averaging = Eigen::MatrixXd::Zero(data.weights.size(), set.size()),
                      .weights = data.weights};
  for (std::size_t q = 0; q < pooled.size(); ++q) {
    const auto row = static_cast<Eigen::Index>(q);
    pooled.for_pairs(q, [&](const OppositePair& pair) {
      for (const auto& readings : {pair.first, pair.second}) {
        for (const std::size_t i : readings) {
          paired.averaging(row, static_cast<Eigen::Index>(i)) +=
              0.5 * pair.weights(0) / (data.weights(row) * static_cast<double>(readings.size()));
        }
      }
    });
  }
  return paired;
}

Estimate estimate_paired(const ReadingSet& given, const Eigen::Vector3d& nominal_in_table) {
  ReadingSet over_temperature;  // `given` with the temperature scales of the previous round
  if (given.temperature.order > 0) {
    over_temperature = given;
  }
  const ReadingSet& set = given.temperature.order > 0 ? over_temperature : given;
  OppositePairs opposites = find_opposite_pairs(set);
  if (opposites.pairs.empty()) {
    throw RefusedError(
        "method 'paired': no reading has an opposite reading (same rest face, block and level, "
        "but the opposite fence face). Repeat the reading on each rest face with the opposite face "
        "at the fence, or use the method 'joint' or 'known'",
        {settings::method});
  }
  const Pooled pooled(opposites.pairs);
  const double F = nominal_in_table.norm();
  if (!(std::abs(nominal_in_table.z()) > smallest_normal_part * F)) {
    throw RefusedError(in_plane_message, {settings::method});
  }
  const Eigen::Vector3d normal(0.0, 0.0, std::copysign(F, nominal_in_table.z()));
  TableField field = set.field.with_all(normal);
  require_determined(
      set, axes_data(set, pooled, 0, field).design.leftCols(set.base_column_count()),
      [&](const DesignPoint& point, double level) -> Eigen::MatrixXd {
        const Eigen::Matrix3d R =
            0.5 * (set.orientation(point) + set.orientation(point.turned_round()));
        return set.design_row(R, level * normal);
      },
      true);
  require_response(set);

  std::vector<AxesData> data;  // the data of the last round
  TableField fitted_for;
  std::optional<Levelness> levelness;
  // Each round adds 6 correct digits or more, or 3 with temperature terms (method.md, section 4).
  const int most_rounds = set.temperature.order > 0 ? 30 : 8;
  for (int round = 0; round < most_rounds; ++round) {
    Estimate so_far;
    data = all_axes_data(set, pooled, field);
    for (const AxesData& alike : data) {
      const Eigen::MatrixXd estimates = estimates_of(set, alike);
      for (Eigen::Index k = 0; k < estimates.cols(); ++k) {
        set_coefficients(set, alike.first + k, estimates.col(k), so_far);
      }
    }
    so_far.field = field;
    fitted_for = field;
    if (!set.has_excluded_readings()) {
      levelness = levelness_of(set, opposites.pairs, so_far, F);
    }
    if (!levelness && field.size() > 1) {
      throw RefusedError(
          "one slope for each block ('level_by'): a block has too few opposite readings to "
          "determine the slope of the table; add opposite readings, or use one slope for the whole "
          "run");
    }
    const TableField next = levelness ? turned_by(*levelness, F, field) : field;
    double turn = 0.0;
    for (std::size_t s = 0; s < field.size(); ++s) {
      turn = std::max(turn, (next.vector(s) - field.vector(s)).norm() / F);
    }
    constexpr double still_rad = 1e-15;
    constexpr double still_scale = 1e-12;
    if (turn <= still_rad && change_of_scale(set, so_far) < still_scale) {
      break;
    }
    field = next;
    over_temperature.temperature.scale = so_far.temperature.scale;
    over_temperature.temperature.along = so_far.response.sensitivity;
  }
  for (const Eigen::Vector3d& vector : field.vectors()) {
    if (!(std::abs(vector.z()) > smallest_normal_part * F)) {
      throw RefusedError(in_plane_message, {settings::method});
    }
  }
  std::vector<AxisRegression> axes;
  for (const AxesData& alike : data) {
    std::vector<AxisRegression> some = regressions_of(set, alike);
    std::move(some.begin(), some.end(), std::back_inserter(axes));
  }
  Estimate estimate = summarize(set, axes, rows_of(pooled, set));
  estimate.field = std::move(fitted_for);
  estimate.levelness = std::move(levelness);
  estimate.unpaired = opposites.unpaired;
  estimate.statistics.observations -= static_cast<int>(opposites.unpaired.size());
  return estimate;
}

namespace {

Estimate fitted_paired(const ReadingSet& readings, bool /*by_field*/) {
  const Eigen::Vector3d direction = stated_field(readings.field).vector(0).normalized();
  return estimate_paired(readings, readings.field.parts().front().magnitude * direction);
}

}  // namespace

MethodFit paired_method() {
  return {.method = Method::paired, .fitted = fitted_paired};
}

}  // namespace axiscal
