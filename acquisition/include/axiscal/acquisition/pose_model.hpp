// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// The value of PoseModelSetup::direction_sd_rad for a field of unknown direction.
inline constexpr double any_direction_rad = 1.0;

/// The prior knowledge about an experiment.
struct PoseModelSetup {
  Instrument instrument;
  /// The nominal directions of the axes, m x 3, from nominal_axes(); zeros for an unknown axis.
  SensitivityMatrix nominal_axes;
  /// The field. Its member `in_table` gives the expected direction. If `in_table` is nullopt, the
  /// expected direction is the table's normal.
  FieldDescription field;
  Positioner positioner;
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  /// Standard deviation of the angle between the field and its nominal direction [rad]. The slope
  /// of a table seldom exceeds 20 mrad.
  double direction_sd_rad = 0.02;
  /// The nominal sensitivity of all axes [unit per field unit]; nullopt if unknown.
  std::optional<double> nominal_sensitivity;
  double misalignment_sd = 0.05;   ///< prior relative uncertainty of the sensitivities
  double placement_sd_rad = 3e-5;  ///< repeatability of the cube's orientation
};

/// A reading at a known design point.
struct PlacedReading {
  DesignEntry entry;
  Eigen::VectorXd mean;  ///< mean of each axis, m entries [unit]
  Eigen::VectorXd u;     ///< standard uncertainty of the mean from noise, m entries [unit]
  /// Rotation, in the table's frame, from PoseModelSetup::field to the field at the time of the
  /// reading. It is computed by change_of_field().
  Eigen::Matrix3d field_turn = Eigen::Matrix3d::Identity();
};

/// The estimate of instrument and table from the readings so far.
struct PoseModelFit {
  LinearResponse response;
  Eigen::Vector3d field_in_table = Eigen::Vector3d::Zero();  ///< field at FieldLevel 1 [field unit]
  /// Standard uncertainties of the x and y components of the field's direction, frame table [rad].
  Eigen::Vector2d slope_u = Eigen::Vector2d::Zero();
  /// Column k: change of the field vector per radian of tilt towards tangent k. The two tangents
  /// are unit vectors perpendicular to the field [field unit per rad].
  Eigen::Matrix<double, 3, 2> field_by_tangents = Eigen::Matrix<double, 3, 2>::Zero();
  /// The ratio of the residuals' variance to the stated variance; at least 1.
  double variance_factor = 1.0;
  double cost = 0.0;  ///< sum of the squared weighted residuals
  /// Covariance of the parameters, in this order: bias (m), sensitivity by rows (3 m), direction of
  /// the field (2), common scale of the sensitivities (1).
  Eigen::MatrixXd covariance;
};

/// The match of a reading with the 24 poses of the cube.
struct PoseJudgement {
  DesignPoint best{Face::minus_z, Face::plus_y};  ///< pose with the smallest chi^2
  /// Logarithm of the likelihood ratio of the best pose to the stated pose: half the difference of
  /// their chi^2.
  double log_ratio = 0.0;
  double misfit = 0.0;              ///< chi^2 of the stated pose, with m degrees of freedom
  double best_misfit = 0.0;         ///< chi^2 of the best pose
  bool looks_like_another = false;  ///< true: another pose fits well and far better
  bool fits_none = false;           ///< true: no pose fits, for example if the cube is tilted
};

/// Detects a wrong pose as soon as a reading is taken. It predicts the reading for each of the 24
/// poses from the prior and the earlier readings, and compares the reading with the predictions.
///
/// The response is v = b + S f, with the bias b, the sensitivity matrix S and the field f in the
/// sensor's frame. f is R_sp R f_table: R is the pose's rotation from the table's frame to the
/// positioner's frame, and R_sp is the rotation from the positioner's frame to the sensor's frame.
/// The prior is weak. It expects S near the matrix of the nominal axes, multiplied by the nominal
/// sensitivity. If the nominal sensitivity is unknown, this factor is fitted. The prior expects
/// f_table, the field in the table's frame, near its nominal direction. The uncertainty of a
/// prediction includes the covariance of the parameters. After few readings this covariance is
/// large, so the model reports only gross mistakes.
///
/// @par Source
/// The Gauss-Newton method with a normal prior. A pose is judged by the chi^2 of its prediction.
class PoseModel {
 public:
  explicit PoseModel(PoseModelSetup setup);

  /// @return true if the model can predict readings. It is false if an axis is one-sided, if the
  ///         field is a sum of several fields, or if a nominal axis or the magnitude of the field
  ///         is unknown.
  [[nodiscard]] bool is_usable() const;

  /// Fits the model to the readings.
  /// @return the best fit; nullopt if `known` is empty or does not determine the scale.
  [[nodiscard]] std::optional<PoseModelFit> fit(const std::vector<PlacedReading>& known) const;

  /// Fits the model to the readings several times, starting at each possible field direction.
  /// @return the best fit first, then the fits that are about as good.
  [[nodiscard]] std::vector<PoseModelFit> fits(const std::vector<PlacedReading>& known) const;

  /// Predicts, from the nominal axes, the smallest possible difference between two readings. The
  /// minimum is taken over the directions of the field in `fits`, or over all possible directions
  /// if `fits` is empty.
  /// @return the smallest norm of the difference of the readings, divided by the effect of the
  ///         field (sensitivity times magnitude); 0 if the readings may be equal.
  [[nodiscard]] double least_contrast(const PlacedReading& one,
                                      const PlacedReading& other,
                                      const std::vector<PoseModelFit>& fits) const;

  /// @param known   the earlier readings, without the reading to be judged.
  /// @param reading the reading to be judged, with its stated point.
  /// @return nullopt if the readings are not enough for a prediction.
  [[nodiscard]] std::optional<PoseJudgement> judge(const std::vector<PlacedReading>& known,
                                                   const PlacedReading& reading) const;

 private:
  [[nodiscard]] Eigen::Matrix3d rotation_at(const PlacedReading& reading,
                                            const DesignPoint& point) const;
  [[nodiscard]] std::optional<double> scale_of(const std::vector<PlacedReading>& readings) const;
  [[nodiscard]] Eigen::VectorXd seen(const PlacedReading& reading,
                                     const Eigen::Vector3d& direction) const;
  [[nodiscard]] double placement_sd() const;
  [[nodiscard]] bool shows_scale(const std::vector<PlacedReading>& readings) const;
  [[nodiscard]] std::vector<PoseModelFit> fits(const std::vector<PlacedReading>& known,
                                               double scale) const;
  [[nodiscard]] std::optional<PoseModelFit> fit_from(const std::vector<PlacedReading>& known,
                                                     double scale,
                                                     const Eigen::Vector3d& start) const;

  PoseModelSetup setup_;
  std::vector<Eigen::Vector3d> directions_;  // approximate directions of the field, frame table
};

}  // namespace axiscal
