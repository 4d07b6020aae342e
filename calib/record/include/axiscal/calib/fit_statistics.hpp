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

/// One row of the regression: a reading, or (`paired`) the average of opposite ones.
struct RegressionRow {
  std::vector<int> runs;             ///< the readings in it
  std::optional<DesignPoint> point;  ///< the first reading's
  int block = 1;
};

/// Residual scatter of replicates against what the model leaves, for one axis.
struct LackOfFit {
  double pure_error_sd = 0.0;  ///< scatter of a reading, from repeats alone [unit]
  double pure_error_dof = 0.0;
  double lack_of_fit_dof = 0.0;
  double f = 0.0;  ///< ratio of the mean squares
  double p_value = 0.0;
};

/// A cause of scatter that the residuals of one fit do not show as such, as the run shows it
/// (method.md, section 4).
struct ScatterComponent {
  std::string name;            ///< as scatter_words.hpp lists them: "blocks", "seats", ...
  Eigen::VectorXd sd;          ///< the estimated value: one for each axis, or one for all
  std::string unit;            ///< of sd
  Eigen::MatrixXd covariance;  ///< its part of the coefficients' covariance, in the same layout
  double degrees_of_freedom = 0.0;
};

/// Under which conditions the scatter was seen (VIM 2.20, 2.22).
struct AXISCAL_EXPORT CalibrationConditions {
  int blocks = 1;  ///< over whose biases the scatter counts
  int mounts = 1;  ///< in the cube; the scatter over their turns counts
  /// Whether blocks or mounts were several, or earlier calibrations say how they scatter; else
  /// repeatability.
  bool intermediate = false;
  int earlier = 0;  ///< earlier calibrations whose scatter between blocks counts
  /// m: mean square of the blocks' biases about their mean [unit^2], with so many degrees of
  /// freedom; empty with one block.
  Eigen::VectorXd block_mean_square;
  double block_degrees_of_freedom = 0.0;
  /// m x 3: as above, for the blocks' sensitivities, each from the block's readings.
  SensitivityMatrix sensitivity_mean_square = SensitivityMatrix(0, 3);
  double sensitivity_degrees_of_freedom = 0.0;
};

/// Statistics of the fit (method.md, section 5); m axes. NaN stands for a value that does not
/// exist.
struct AXISCAL_EXPORT FitStatistics {
  int observations = 0;                ///< readings used
  Eigen::VectorXd degrees_of_freedom;  ///< per axis, of residual_sd
  Eigen::VectorXd residual_sd;         ///< per axis, of one reading [unit]
  Eigen::VectorXd r_squared;           ///< per axis
  Eigen::VectorXd bias_se;             ///< standard errors [unit]
  SensitivityMatrix sensitivity_se;    ///< [unit per field unit]
  Eigen::VectorXd coverage_factor;     ///< per axis, Student's t for 95 %
  Eigen::VectorXd interval_95;         ///< half width of each parameter's interval, of all scatter
  Eigen::VectorXd interval_dof;        ///< degrees of freedom of each parameter's interval
  std::vector<ScatterComponent> components;  ///< parts of the covariance besides residual_sd
  std::vector<std::string> parameter_names;  ///< "x.bias", "x.sensitivity.x", ...: 4 m
  Eigen::MatrixXd covariance;                ///< 4m x 4m, in that order
  double condition_number = 1.0;             ///< the design's, its columns of length 1
  SensitivityMatrix variance_inflation;      ///< one for each sensitivity column and axis
  std::vector<LackOfFit> lack_of_fit;        ///< per axis; empty without replicates
  std::vector<RegressionRow> rows;           ///< r of them
  Eigen::MatrixXd leverage;                  ///< r x m, in the layout of the others
  Eigen::MatrixXd studentized;               ///< externally studentised residuals
  Eigen::MatrixXd cooks_distance;
  Eigen::MatrixXd robust_weight;           ///< empty unless robust regression was asked for
  std::vector<int> observations_per_axis;  ///< where axes leave readings out; else empty

  /// @return the part of the covariance from the readings' scatter: the covariance minus its
  ///         components.
  [[nodiscard]] Eigen::MatrixXd covariance_of_readings() const;

  /// @return the row of `covariance` for a parameter, for example "x.bias"; nullopt if it is
  ///         absent.
  [[nodiscard]] std::optional<Eigen::Index> position_of(std::string_view parameter) const;
};

}  // namespace axiscal
