// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// One row of the regression: a reading, or for method `paired` an average of opposite readings.
struct RegressionRow {
  std::vector<int> runs;             ///< run numbers of the readings in the row
  std::optional<DesignPoint> point;  ///< design point of the first reading
  int block = 1;
};

/// The lack-of-fit test of one axis. It compares the residuals of the model with the scatter of
/// repeated readings.
struct LackOfFit {
  double pure_error_sd = 0.0;  ///< scatter of a reading, from repeated readings only [unit]
  double pure_error_dof = 0.0;
  double lack_of_fit_dof = 0.0;
  double f = 0.0;  ///< mean square of the lack of fit, divided by that of the pure error
  double p_value = 0.0;
};

/// A cause of scatter that residual_sd does not include, with its size in this run (method.md,
/// section 4.1).
struct ScatterComponent {
  std::string name;            ///< a name in scatter_words.cpp: "blocks", "seats", ...
  Eigen::VectorXd sd;          ///< estimated standard deviation: m entries, or one for all axes
  std::string unit;            ///< unit of sd
  Eigen::MatrixXd covariance;  ///< contribution to FitStatistics::covariance, same layout
  double degrees_of_freedom = 0.0;
};

/// The conditions under which the scatter was observed: repeatability or intermediate precision
/// (VIM 2.20, 2.22).
struct AXISCAL_EXPORT CalibrationConditions {
  /// Number of blocks. The uncertainties include the scatter of the biases between blocks.
  int blocks = 1;
  /// Number of mountings in the cube. The uncertainties include the rotations between mountings.
  int mounts = 1;
  /// True for intermediate precision: several blocks, several mountings, or the scatter of earlier
  /// calibrations. False for repeatability.
  bool intermediate = false;
  int earlier = 0;  ///< number of earlier calibrations that contribute to the scatter of blocks
  /// Mean square of the blocks' biases about their mean, m entries [unit^2]; empty for one block.
  Eigen::VectorXd block_mean_square;
  double block_degrees_of_freedom = 0.0;
  /// Mean square of the blocks' sensitivities about their mean, m x 3; empty if not estimated.
  SensitivityMatrix sensitivity_mean_square = SensitivityMatrix(0, 3);
  double sensitivity_degrees_of_freedom = 0.0;
};

/// Statistics of the fit of m axes (method.md, section 5). NaN means that a value does not exist.
struct AXISCAL_EXPORT FitStatistics {
  int observations = 0;                      ///< readings used
  Eigen::VectorXd degrees_of_freedom;        ///< per axis, degrees of freedom of residual_sd
  Eigen::VectorXd residual_sd;               ///< per axis, residual sd of one reading [unit]
  Eigen::VectorXd r_squared;                 ///< per axis, R^2 of the regression
  Eigen::VectorXd bias_se;                   ///< standard errors of the biases, m entries [unit]
  SensitivityMatrix sensitivity_se;          ///< standard errors, m x 3 [unit per field unit]
  Eigen::VectorXd coverage_factor;           ///< per axis, Student's t (95 %) of degrees_of_freedom
  Eigen::VectorXd interval_95;               ///< half width of each parameter's 95 % interval
  Eigen::VectorXd interval_dof;              ///< degrees of freedom of each parameter's interval
  std::vector<ScatterComponent> components;  ///< causes of scatter not included in residual_sd
  std::vector<std::string> parameter_names;  ///< p names: "x.bias", "x.sensitivity.x", ...
  Eigen::MatrixXd covariance;                ///< covariance of all parameters, p x p
  double condition_number = 1.0;             ///< condition number; columns scaled to length 1
  SensitivityMatrix variance_inflation;      ///< variance inflation factor of each entry of S
  std::vector<LackOfFit> lack_of_fit;        ///< test of each axis; empty without repeated readings
  std::vector<RegressionRow> rows;           ///< r rows of the regression
  Eigen::MatrixXd leverage;                  ///< leverage of each row for each axis, r x m
  Eigen::MatrixXd studentized;               ///< externally studentised residuals, r x m
  Eigen::MatrixXd cooks_distance;            ///< Cook's distances, r x m
  Eigen::MatrixXd robust_weight;             ///< robust weights 0 to 1, r x m; empty if not used
  /// number of readings used for each axis; empty if all are used
  std::vector<int> observations_per_axis;

  /// @return the covariance from the scatter of the readings alone: `covariance` minus the
  ///         covariances of `components`.
  [[nodiscard]] Eigen::MatrixXd covariance_of_readings() const;

  /// @param parameter  name of the parameter, for example "x.bias".
  /// @return the index of the parameter's row in `covariance`; nullopt if the parameter is absent.
  [[nodiscard]] std::optional<Eigen::Index> position_of(std::string_view parameter) const;

  /// @param name  name of the component, for example "seats".
  /// @return the component in `components`; null if it is absent.
  [[nodiscard]] const ScatterComponent* find_component(std::string_view name) const;
};

}  // namespace axiscal
