// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/uncertainty_sources.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include <Eigen/Geometry>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/record/parameter_names.hpp"

namespace axiscal {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

class BudgetMaker {
 public:
  BudgetMaker(const Experiment& experiment,
              const ReadingSet& set,
              const Calibration& calibration,
              const TableField& field)
      : experiment_(experiment),
        set_(set),
        calibration_(calibration),
        field_(field),
        statistics_(*calibration.fit.statistics) {}

  UncertaintyBudget make(std::vector<UncertaintySource> weighed) {
    budget_.resolution = experiment_.stated.resolution;
    budget_.temperature_u = experiment_.stated.temperature_u;
    budget_.sources.push_back({.name = "fit",
                               .type = "A",
                               .distribution = "t",
                               .input_u = not_a_number,
                               .degrees_of_freedom = not_a_number});
    const bool weighs = !weighed.empty();
    std::move(weighed.begin(), weighed.end(), std::back_inserter(budget_.sources));
    add_field_magnitude();
    add_reference();
    if (method_kind(calibration_.fit.method).directions_known && field_.has_vectors() && !weighs &&
        set_.seen.cols() == 0) {
      add_given_directions();
    }
    add_mount();
    if (set_.size() > 0 && field_.has_vectors()) {
      add_resolution();
    }
    return std::move(budget_);
  }

 private:
  void add(std::string name,
           std::string distribution,
           double input_u,
           std::string input_unit,
           Eigen::MatrixXd covariance) {
    budget_.sources.push_back({.name = std::move(name),
                               .type = "B",
                               .distribution = std::move(distribution),
                               .input_u = input_u,
                               .input_unit = std::move(input_unit),
                               .degrees_of_freedom = infinite,
                               .covariance = std::move(covariance)});
  }

  [[nodiscard]] Eigen::Index parameters() const { return statistics_.covariance.rows(); }

  // Converts a change of the sensitivities to a vector with one entry for each parameter.
  [[nodiscard]] Eigen::VectorXd parameters_of(const SensitivityMatrix& change) const {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(parameters());
    for (Eigen::Index k = 0; k < change.rows(); ++k) {
      const std::string& axis = calibration_.sensor.instrument.axes[static_cast<std::size_t>(k)];
      const std::vector<std::string> names = names_of_columns({axis}, {1, 2, 3}, {});
      for (int j = 0; j < 3; ++j) {
        if (const auto at = statistics_.position_of(names[static_cast<std::size_t>(j)])) {
          all(*at) = change(k, j);
        }
      }
    }
    return all;
  }

  void add_field_magnitude() {
    const FieldDescription& field = calibration_.sensor.field;
    for (std::size_t part = 0; part < field.parts.size(); ++part) {
      add_part_magnitude(part);
    }
    if (!(field.magnitude_u > 0.0) || !field.parts.empty()) {
      return;
    }
    const Eigen::VectorXd change = field.magnitude_u / field.magnitude *
                                   parameters_of(calibration_.sensor.response.sensitivity);
    add(field_magnitude_source, "normal", field.magnitude_u, field.unit,
        change * change.transpose());
  }

  // Adds the uncertainty of the electrical reference of the readings, for example of a voltmeter.
  // An error of this reference multiplies all readings, biases and sensitivities by one factor. The
  // coefficients of the temperature scale are relative and do not change.
  void add_reference() {
    const double u = experiment_.stated.reference_u;
    if (!(u > 0.0)) {
      return;
    }
    Eigen::VectorXd change = Eigen::VectorXd::Zero(parameters());
    for (std::size_t i = 0; i < statistics_.parameter_names.size(); ++i) {
      const std::string& name = statistics_.parameter_names[i];
      if (name.find(".scale.") == std::string::npos) {
        change(static_cast<Eigen::Index>(i)) = u * parameter_value(calibration_.sensor, name);
      }
    }
    add(reference_source, "normal", u, "1", change * change.transpose());
  }

  // Adds the effect of the uncertain magnitude of a part of the field. A part whose magnitude is
  // fitted has no such uncertainty.
  void add_part_magnitude(std::size_t which) {
    const FieldDescription& part = calibration_.sensor.field.parts[which];
    if (!(part.magnitude_u > 0.0) || part.free_length || field_.size() <= which) {
      return;
    }
    const Eigen::Vector3d longer = part.magnitude_u / part.magnitude * field_.vector(which);
    Eigen::VectorXd changes = Eigen::VectorXd::Zero(set_.size() * set_.axis_count());
    for (Eigen::Index i = 0; i < set_.size(); ++i) {
      const Eigen::Vector3d more = set_.rotation_sensor_from_table[static_cast<std::size_t>(i)] *
                                   (set_.field_change(i, field_, which) * longer);
      for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
        if (set_.sees(k, i, which)) {
          changes(run().row_of(i, k)) = run().change_with_field(i, k) * more;
        }
      }
    }
    const Eigen::VectorXd change = solution_change(changes);
    add("magnitude of " + part.kind, "normal", part.magnitude_u, calibration_.sensor.field.unit,
        change * change.transpose());
  }

  // Returns the model linearised about the fit. It is computed at the first call. If the residuals
  // are 0, the directions are treated as known.
  [[nodiscard]] const Fit& run() {
    if (!run_) {
      const bool known = method_kind(calibration_.fit.method).directions_known ||
                         !(statistics_.residual_sd.array() > 0.0).all();
      SolvedReadings state(set_, known);
      run_.emplace(state, field_,
                   known ? Eigen::VectorXd(Eigen::VectorXd::Ones(set_.axis_count()))
                         : statistics_.residual_sd);
    }
    return *run_;
  }

  // Returns the change of the coefficients for changes of the readings. If the directions are
  // fitted, they absorb a part of these changes.
  [[nodiscard]] Eigen::MatrixXd solution_change(const Eigen::MatrixXd& changes) {
    return run().solution_change(changes)(set_.coefficient_column_indices(), Eigen::all);
  }

  void add_given_directions() {
    for (const InputQuantity& input : input_quantities(experiment_, set_, true, field_)) {
      if (input.name != "positioner") {
        const Eigen::MatrixXd changes =
            solution_change(input_error_jacobian({input}, run(), field_));
        add(input.name, input.distribution, input.u, input.unit, changes * changes.transpose());
      }
    }
  }

  // Adds the uncertainty of the instrument's orientation in the cube. The orientation changes
  // slightly each time the instrument is mounted.
  void add_mount() {
    const std::optional<Mount> mount = experiment_.positioner.mount(experiment_.slot);
    if (!mount || !(mount->repeatability_rad > 0.0)) {
      return;
    }
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(parameters(), parameters());
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(j);
      SensitivityMatrix turned(calibration_.sensor.response.sensitivity.rows(), 3);
      for (Eigen::Index k = 0; k < turned.rows(); ++k) {
        // A rotation w changes the field f by w cross f. The response of the axis with the row S of
        // sensitivities changes by S (w cross f) = (S cross w) f.
        const Eigen::Vector3d row = calibration_.sensor.response.sensitivity.row(k);
        turned.row(k) = row.cross(axis).transpose();
      }
      const Eigen::VectorXd change = mount->repeatability_rad * parameters_of(turned);
      covariance += change * change.transpose();
    }
    add("mount", "normal", mount->repeatability_rad, "rad", std::move(covariance));
  }

  // Returns true if the scatter already includes the rounding error of an axis.
  [[nodiscard]] bool is_counted_as_scatter(Eigen::Index axis) const {
    const ScatterComponent* const rounding = statistics_.find_component("rounding");
    return rounding != nullptr && rounding->sd(axis) > 0.0;
  }

  // Adds the part of the rounding error that the scatter does not show. For a rounding step q, the
  // variance of this part is q^2 / 12 minus the variance of the scatter, if this is positive.
  void add_resolution() {
    const double q = experiment_.stated.resolution;
    if (!(q > 0.0)) {
      return;
    }
    const AxisDesigns designs(set_, field_);
    const Eigen::MatrixXd map = set_.observable_column_map();
    const Eigen::Index p = set_.coefficient_count();
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(parameters(), parameters());
    for (Eigen::Index k = 0; k < set_.axis_count(); ++k) {
      const double seen = statistics_.residual_sd(k);
      const double hidden =
          is_counted_as_scatter(k) ? 0.0 : q * q / 12.0 - (seen > 0.0 ? seen * seen : 0.0);
      if (hidden > 0.0) {
        const Eigen::MatrixXd unscaled =
            map *
            LeastSquaresDesign(set_.observable_columns(designs.of(k), k), set_.weights.col(k))
                .unscaled_covariance() *
            map.transpose();
        covariance.block(p * k, p * k, p, p) = hidden * unscaled.topLeftCorner(p, p);
      }
    }
    add("resolution", "rectangular", q / std::sqrt(12.0), calibration_.sensor.instrument.unit,
        std::move(covariance));
  }

  const Experiment& experiment_;
  const ReadingSet& set_;
  const Calibration& calibration_;
  const TableField& field_;
  const FitStatistics& statistics_;
  std::optional<Fit> run_;
  UncertaintyBudget budget_;
};

}  // namespace

UncertaintyBudget make_budget(const Experiment& experiment,
                              const ReadingSet& set,
                              const Calibration& calibration,
                              const TableField& field,
                              std::vector<UncertaintySource> weighed) {
  return BudgetMaker(experiment, set, calibration, field).make(std::move(weighed));
}

}  // namespace axiscal
