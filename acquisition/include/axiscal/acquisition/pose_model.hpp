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

/// The prior knowledge of an experiment.
struct PoseModelSetup {
  Instrument instrument;
  /// The nominal directions of the axes, m x 3, from nominal_axes(); zeros for an unknown axis.
  SensitivityMatrix nominal_axes;
  FieldDescription field;  ///< in_table is the expected field; without it: the table's normal
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

/// A reading at a known point.
struct PlacedReading {
  DesignEntry entry;
  Eigen::VectorXd mean;  ///< m entries [unit]
  Eigen::VectorXd u;     ///< standard uncertainty of the mean from noise, m entries [unit]
  /// The change of the field in the table since the set-up, from change_of_field().
  Eigen::Matrix3d field_turn = Eigen::Matrix3d::Identity();
};

/// The estimate of instrument and table from the readings so far.
struct PoseModelFit {
  LinearResponse response;
  Eigen::Vector3d field_in_table = Eigen::Vector3d::Zero();  ///< the field at level 1 [field unit]
  /// Standard uncertainties of the direction's x and y components in the table [rad].
  Eigen::Vector2d slope_u = Eigen::Vector2d::Zero();
  /// The derivative of the field with respect to the two tangents [field unit per rad].
  Eigen::Matrix<double, 3, 2> field_by_tangents = Eigen::Matrix<double, 3, 2>::Zero();
  double variance_factor =
      1.0;            ///< ratio of the residuals' variance to the stated variance; at least 1
  double cost = 0.0;  ///< sum of the squared weighted residuals
  Eigen::MatrixXd covariance;  ///< order: bias (m), sensitivity by rows (3 m), two tangents, scale
};

/// The match of a reading with the 24 poses of the cube.
struct PoseJudgement {
  DesignPoint best{Face::minus_z, Face::plus_y};  ///< pose with the smallest chi^2
  double log_ratio = 0.0;  ///< half the difference between misfit and best_misfit
  double misfit = 0.0;     ///< chi^2 of the stated pose, m degrees of freedom
  double best_misfit = 0.0;
  bool looks_like_another = false;  ///< another pose fits far better, and its chi^2 is acceptable
  bool fits_none = false;           ///< no pose fits: cube tilted, on grit, or not at rest
};

/// Predicts the reading in each of the 24 poses from the prior and the earlier readings, and so
/// detects a wrong pose at once.
///
/// The response is v = b + S f with f = R_sp R f_table. The prior is weak: S is about s times the
/// nominal axes, s is nominal or unknown, and f_table is about its nominal direction. The
/// covariance of the parameters is part of each prediction. With few readings the model therefore
/// reports only gross mistakes.
///
/// @par Source
/// The Gauss-Newton method with a normal prior; chi^2 of each pose's prediction.
class PoseModel {
 public:
  explicit PoseModel(PoseModelSetup setup);

  /// @return true if the model can predict readings; false for one-sided axes or a sum of fields.
  [[nodiscard]] bool is_usable() const;

  /// Fits the model to the readings. @return the best fit; nullopt without readings, or if they do
  /// not determine the scale.
  [[nodiscard]] std::optional<PoseModelFit> fit(const std::vector<PlacedReading>& known) const;

  /// Fits the model to the readings, once from each possible direction of the field.
  /// @return the best fit first, then the fits that are about as good.
  [[nodiscard]] std::vector<PoseModelFit> fits(const std::vector<PlacedReading>& known) const;

  /// @return the smallest predicted distance between two readings, relative to the effect of the
  ///         field; 0 if they may be equal. The minimum is over the directions of the field in
  ///         `fits`, or over all possible directions if `fits` is empty.
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
  std::vector<Eigen::Vector3d> directions_;  // approximate possible field directions, frame table
};

}  // namespace axiscal
