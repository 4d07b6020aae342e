// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/choices.hpp"
#include "axiscal/calib/correction.hpp"
#include "axiscal/calib/temperature.hpp"
#include "axiscal/calib/uncertainty_budget.hpp"
#include "axiscal/calib/verdict.hpp"
#include "axiscal/field/field_description.hpp"
#include "axiscal/field/field_level.hpp"
#include "axiscal/field/site.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

/// Diagnostics of one row of the regression: a reading, or (`paired`) the average of opposite ones.
struct RegressionRow {
  std::vector<int> runs;             ///< the readings in it
  std::optional<DesignPoint> point;  ///< the first reading's
  int block = 1;
  Eigen::VectorXd leverage;     ///< m entries, one per axis; likewise the others
  Eigen::VectorXd studentized;  ///< externally studentised residual
  Eigen::VectorXd cooks_distance;
  Eigen::VectorXd robust_weight;  ///< empty unless robust regression was asked for
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
  std::string name;            ///< "blocks", "correlation", "seats", "mounts", "rounding"
  Eigen::VectorXd sd;          ///< what was found: one for each axis, or one for all
  std::string unit;            ///< of sd
  Eigen::MatrixXd covariance;  ///< what it adds to that of the coefficients, as theirs
  double degrees_of_freedom = 0.0;
};

/// Under which conditions the scatter was seen (VIM 2.20, 2.22).
struct CalibrationConditions {
  int blocks = 1;  ///< over whose biases the scatter counts
  int mounts = 1;  ///< likewise of the instrument in the cube
  /// Whether blocks or mounts were several, or earlier calibrations say how they scatter; else
  /// repeatability.
  bool intermediate = false;
  int earlier = 0;  ///< earlier calibrations whose scatter between blocks counts
  /// m: mean square of the blocks' biases about their mean [unit^2], with so many degrees of
  /// freedom; empty with one block.
  Eigen::VectorXd block_mean_square;
  double block_degrees_of_freedom = 0.0;
};

/// Statistics of the fit (method.md, section 5); m axes. NaN stands for what does not exist.
struct FitStatistics {
  int observations = 0;                ///< readings used
  Eigen::VectorXd degrees_of_freedom;  ///< per axis, of residual_sd
  Eigen::VectorXd residual_sd;         ///< per axis, of one reading [unit]
  Eigen::VectorXd r_squared;           ///< per axis
  Eigen::VectorXd bias_se;             ///< standard errors [unit]
  SensitivityMatrix sensitivity_se;    ///< [unit per field unit]
  Eigen::VectorXd coverage_factor;     ///< per axis, Student's t for 95 %
  Eigen::VectorXd interval_95;         ///< half width of each parameter's interval, of all scatter
  Eigen::VectorXd interval_dof;        ///< degrees of freedom of each parameter's interval
  std::vector<ScatterComponent> components;  ///< which the covariance holds besides residual_sd's
  std::vector<std::string> parameter_names;  ///< "x.bias", "x.sensitivity.x", ...: 4 m
  Eigen::MatrixXd covariance;                ///< 4m x 4m, in that order
  double condition_number = 1.0;             ///< the design's, its columns of length 1
  SensitivityMatrix variance_inflation;      ///< one for each sensitivity column and axis
  std::vector<LackOfFit> lack_of_fit;        ///< per axis; empty without replicates
  std::vector<RegressionRow> rows;
  std::vector<int> observations_per_axis;  ///< where axes leave readings out; else empty

  /// @return what the readings' own scatter makes of the covariance: it less its components.
  [[nodiscard]] Eigen::MatrixXd covariance_of_readings() const;

  /// @return the row of `covariance` that is of a parameter, as "x.bias"; nothing where it has
  /// none.
  [[nodiscard]] std::optional<Eigen::Index> position_of(std::string_view parameter) const;
};

/// What an instrument answers to besides its field: a gyroscope to gravity.
struct AlsoResponse {
  std::string kind;
  std::string unit;
  Eigen::Vector3d in_table = Eigen::Vector3d::Zero();  ///< as given [unit]
  SensitivityMatrix sensitivity;                       ///< m x 3 [unit of the readings per unit]
  SensitivityMatrix sensitivity_se;                    ///< its standard errors
};

/// One estimate of the table's levelness: from the opposite readings of one rest face.
struct LevelnessEstimate {
  DesignPoint point;  ///< rest face and the first of the two fence faces
  int block = 1;
  double x = 0.0;  ///< field along the table's x / F; for gravity the slope [rad]
  double y = 0.0;
};

/// The levelness of one block, where each has its own.
struct BlockLevelness {
  int block = 1;
  double x = 0.0;  ///< as in LevelnessEstimate
  double y = 0.0;
  double standard_error_x = 0.0;
  double standard_error_y = 0.0;
};

/// The levelness that all instruments of an assembly say together: they stand on one table. Where
/// each block has its own levelness it is that of the last block.
struct CombinedLevelness {
  std::vector<std::string> slots;
  double x = 0.0;  ///< mean, weighted by the slots' variances
  double y = 0.0;
  double standard_error_x = 0.0;
  double standard_error_y = 0.0;
  double p_value = 1.0;    ///< that the slots differ so much by chance; NaN where not testable
  bool consistent = true;  ///< p_value is not below 0.001
  std::string suspect;     ///< where not consistent: the slot; of two nobody knows which, so empty
};

/// The field's components along the table's x and y, divided by its magnitude. For gravity slopes:
/// x > 0 means that the table rises towards +x.
struct Levelness {
  std::vector<LevelnessEstimate> estimates;
  double mean_x = 0.0;
  double mean_y = 0.0;
  double sd_x = 0.0;  ///< spread of the estimates; NaN for fewer than two
  double sd_y = 0.0;
  double standard_error_x =
      0.0;  ///< how well the mean is known, from the scatter within the differences
  double standard_error_y = 0.0;
  double degrees_of_freedom = 0.0;  ///< those of the standard errors
  bool consistent = true;           ///< p_value is not below 0.005
  double p_value = 0.0;        ///< that estimates differ so much by chance; NaN where not testable
  double block_p_value = 1.0;  ///< that blocks differ so much by chance; NaN where not testable
  std::optional<LevelnessEstimate> suspect;   ///< where not consistent: the face that disagrees
  std::vector<BlockLevelness> blocks;         ///< where each block has its own; else empty
  std::optional<CombinedLevelness> combined;  ///< what an assembly's slots say together

  /// @return how the table stands after the run: the last block's where each has its own, else the
  ///         mean of all.
  [[nodiscard]] BlockLevelness as_it_stands() const {
    return blocks.empty() ? BlockLevelness{.x = mean_x,
                                           .y = mean_y,
                                           .standard_error_x = standard_error_x,
                                           .standard_error_y = standard_error_y}
                          : blocks.back();
  }

  /// @return the levelness of one block, by its position among them; the mean where there is one.
  [[nodiscard]] Eigen::Vector2d of_level(std::size_t position) const {
    return blocks.empty() ? Eigen::Vector2d(mean_x, mean_y)
                          : Eigen::Vector2d(blocks.at(position).x, blocks.at(position).y);
  }
};

/// What the fit leaves of one reading.
struct ReadingResidual {
  int run = 1;
  std::optional<DesignPoint> point;
  std::optional<FieldLevel> level;
  std::optional<int> block;
  std::optional<double> temperature;
  Eigen::VectorXd response;  ///< response less the fit, m entries [unit]
  double magnitude = 0.0;    ///< |f_hat| - F [field unit]; NaN for m < 3
  bool used = true;          ///< false: left out of the fit
};

/// One axis fitted in the known-art form: bias, sensitivity, coning angle, azimuth.
struct PolarFit {
  double bias = 0.0;  ///< [unit of the readings]
  PolarForm form;
  double residual_sd = 0.0;  ///< scatter of one reading; NaN without degrees of freedom
  int rounds = 0;            ///< that Gauss-Newton took
  bool converged = false;
};

/// How well orientations without labels cover the sphere, and how well the fit explains them: the
/// figures that users know from magneto and MotionCal.
struct OrientationQuality {
  double fit_error = 0.0;         ///< rms of |f| - F, relative to F
  double magnitude_spread = 0.0;  ///< standard deviation of |f|, relative to F
  double coverage = 0.0;          ///< share of the sphere that is within 30 degrees of a reading
  double largest_gap_rad = 0.0;   ///< from a direction that no reading is near to the nearest one
  Eigen::Vector3d gap = Eigen::Vector3d::UnitZ();  ///< that direction, frame sensor
};

/// How two instruments that were recorded together are turned against each other.
struct Alignment {
  Eigen::Matrix3d rotation_companion_from_sensor = Eigen::Matrix3d::Identity();
  Eigen::Vector3d standard_error_rad = Eigen::Vector3d::Zero();  ///< about x, y, z of the companion
  double angle_rad = 0.0;  ///< between the two fields; the dip is this less 90 degrees
  double angle_se_rad = 0.0;
  double residual_sd = 0.0;  ///< scatter of the cosine of that angle
};

/// How the instrument's frame was turned to that of another that was recorded with it.
struct CompanionAlignment {
  std::string record;  ///< the companion's, as given
  Alignment alignment;
};

/// Something that asks for the user's attention.
struct CalibrationWarning {
  WarningCode code = WarningCode::other;
  std::vector<int> runs;  ///< the readings concerned; may be empty
  std::string message;    ///< what is so and what to do
};

/// A file that went into a calibration.
struct InputFileDigest {
  std::string path;
  std::string sha256;
  bool is_log = false;  ///< whose rests were the readings; else a table of them
};

/// One number of a result with its uncertainty.
struct Quantity {
  double value = 0.0;
  double u = 0.0;    ///< combined standard uncertainty; NaN where none is known
  double U = 0.0;    ///< expanded, half the width of the 95 % interval; NaN likewise
  double dof = 0.0;  ///< effective degrees of freedom; NaN likewise
  std::string unit;  ///< of value, u and U
};

/// The result of a calibration: what a record file holds (formats.md, Record).
struct Calibration {
  std::string created;   ///< ISO 8601, UTC
  std::string software;  ///< e.g. "axiscal 0.1.0"
  CalibrationStatus status = CalibrationStatus::ok;
  std::vector<InputFileDigest> inputs;
  /// What was calibrated, and how, as experiment_json() writes it; empty where that is not known.
  std::string experiment;
  Instrument instrument;
  FieldDescription field;
  std::optional<Method> method;  ///< nothing where another software did it
  Weighting weights = Weighting::none;
  bool robust = false;
  std::string positioner;       ///< its id; empty for the nominal cube
  std::string slot;             ///< where in an assembly the instrument sat; may be empty
  int instance = 0;             ///< number of the sensor among those of its kind in a log
  std::string device;           ///< by which the vehicle's software knows the sensor; may be empty
  bool level_by_block = false;  ///< whether each block has its own levelness
  std::vector<int> left_out;    ///< runs not used
  LinearResponse response;      ///< the coefficients; over temperature at its reference
  std::optional<TemperatureResponse> temperature;  ///< where it was modelled
  std::vector<AlsoResponse> also;
  std::vector<PolarFit> polar_fit;      ///< the known-art fit of each axis, where it was asked for
  std::optional<MagnitudeShape> shape;  ///< how method magnitude takes S
  std::optional<FitStatistics> statistics;
  std::optional<UncertaintyBudget> uncertainty;    ///< where there are statistics
  CalibrationConditions conditions;                ///< of the scatter in the statistics
  std::optional<OrientationQuality> orientations;  ///< method magnitude
  /// Method turns: the attitude error after each turn [rad], in the sensor's frame before it.
  std::vector<Eigen::Vector3d> turn_errors_rad;
  std::optional<CompanionAlignment> alignment;  ///< with an instrument recorded together
  std::optional<Levelness> levelness;
  std::vector<ReadingResidual> residuals;
  std::optional<Verdict> verdict;  ///< where limits were applied
  std::vector<CalibrationWarning> warnings;
  std::optional<Correction> suggestion;  ///< what would mend the run, where a mistake was found
  std::vector<Correction> corrections;   ///< that were made on request; points, levels, responses
                                         ///< are not kept in the file
  std::vector<std::string> notes;

  /// @param name  "x.bias", "x.sensitivity.y", "z.scale.d2", ...
  /// @return that parameter with its uncertainty, scatter and stated inputs together.
  /// @throws DomainError  for a name that is none of the record's; the message suggests one.
  [[nodiscard]] Quantity parameter(const std::string& name) const;
};

/// The reading that a calibration expects.
///
/// @param field_in_sensor  f [field unit].
/// @param temperature      of the sensor; without one the reference counts.
/// @return v, m entries [unit]; without second fields.
[[nodiscard]] Eigen::VectorXd response_at(const Calibration& calibration,
                                          const Eigen::Vector3d& field_in_sensor,
                                          std::optional<double> temperature);

/// The way back: what would have been read at the reference temperature.
/// @param readings     v, m entries [unit].
/// @param temperature  at which they were taken; without one, or without terms, they stay.
[[nodiscard]] Eigen::VectorXd reading_at_reference(const Calibration& calibration,
                                                   Eigen::VectorXd readings,
                                                   std::optional<double> temperature);

/// @return whether reduced readings are the field: not where a record of method bias, made without
///         another one's sensitivities, has in its biases what the instrument met of the field.
[[nodiscard]] bool gives_field(const Calibration& calibration);

/// @return whether a record was made from one of these files, by their SHA-256.
[[nodiscard]] bool is_made_from(const Calibration& calibration,
                                const std::vector<InputFileDigest>& inputs);

/// @return what users of this kind of instrument call the calibration: hard iron, responsivity, ...
[[nodiscard]] std::vector<KindQuantity> quantities_of(const Calibration& calibration);

}  // namespace axiscal
