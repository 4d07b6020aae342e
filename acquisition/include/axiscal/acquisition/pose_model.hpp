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

/// As PoseModelSetup::direction_sd_rad: it may point anywhere.
inline constexpr double any_direction_rad = 1.0;

/// The prior knowledge of an experiment.
struct PoseModelSetup {
  Instrument instrument;
  /// The nominal directions of the axes, m x 3, as nominal_axes(); a row of zeros: unknown.
  SensitivityMatrix nominal_axes;
  FieldDescription field;  ///< in_table: where it is expected; else along the table's normal
  Positioner positioner;
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  /// Standard deviation of the angle between the field and its nominal direction [rad]. A table is
  /// seldom 20 mrad off level.
  double direction_sd_rad = 0.02;
  /// The nominal sensitivities of the axes [unit per field unit]; nullopt if unknown.
  std::optional<double> nominal_sensitivity;
  double misalignment_sd = 0.05;   ///< prior relative uncertainty of the sensitivities
  double placement_sd_rad = 3e-5;  ///< repeatability of a seat
};

/// A reading that was taken at a known point.
struct PlacedReading {
  DesignEntry entry;
  Eigen::VectorXd mean;  ///< m entries [unit]
  Eigen::VectorXd u;     ///< its standard uncertainty from noise
  /// The rotation of the field in the table since the set-up, as change_of_field().
  Eigen::Matrix3d field_turn = Eigen::Matrix3d::Identity();
};

/// The estimate of instrument and table from the readings so far.
struct PoseModelFit {
  LinearResponse response;
  Eigen::Vector3d field_in_table = Eigen::Vector3d::Zero();  ///< at level 1 [field unit]
  Eigen::Vector2d slope_u = Eigen::Vector2d::Zero();  ///< standard uncertainty of its direction
  /// The derivative of the field with respect to the two tangents [field unit per rad].
  Eigen::Matrix<double, 3, 2> field_by_tangents = Eigen::Matrix<double, 3, 2>::Zero();
  double variance_factor =
      1.0;            ///< ratio of the variance of the scatter to the stated one; at least 1
  double cost = 0.0;  ///< sum of the squared weighted residuals
  Eigen::MatrixXd covariance;  ///< covers bias (m), sensitivity by rows (3 m), two tangents, scale
};

/// The match of a reading with the 24 poses of the cube.
struct PoseJudgement {
  DesignPoint best{Face::minus_z, Face::plus_y};  ///< that fits it best
  double log_ratio = 0.0;  ///< ln of how much better that fits: half the difference of chi^2
  double misfit = 0.0;     ///< chi^2, m degrees of freedom, if it lies as stated
  double best_misfit = 0.0;
  bool looks_like_another = false;  ///< another one fits far better, and fits
  bool fits_none = false;           ///< nothing fits: tilted, grit, or not at rest
};

/// Predicts the reading in each of the 24 poses from the prior and the earlier readings, and so
/// detects a wrong pose at once.
///
/// The response v = b + S f, f = R_sp R f_table, with weak expectations as a prior: S about s times
/// the nominal axes, s unknown or nominal; f_table about its nominal direction. The parameters'
/// covariance goes into each prediction, so that with few readings only gross mistakes are said.
///
/// @par Source
/// Gauss and Newton's method with a normal prior; chi^2 of each pose's prediction.
class PoseModel {
 public:
  explicit PoseModel(PoseModelSetup setup);

  /// @return whether anything can be predicted: not for one-sided axes.
  [[nodiscard]] bool is_usable() const;

  /// Fits the model to the readings. @return the best fit; nullopt without readings, or if they do
  /// not determine the scale.
  [[nodiscard]] std::optional<PoseModelFit> fit(const std::vector<PlacedReading>& known) const;

  /// Fits what is known from each direction that the field may have.
  /// @return those that explain it about as well as the best one, which is the first.
  [[nodiscard]] std::vector<PoseModelFit> fits(const std::vector<PlacedReading>& known) const;

  /// @return the smallest distance between the readings of two points, relative to the effect of
  ///         the field: by the fits; without fits, over all possible directions of the field; 0 if
  ///         the readings may be equal.
  [[nodiscard]] double least_contrast(const PlacedReading& one,
                                      const PlacedReading& other,
                                      const std::vector<PoseModelFit>& fits) const;

  /// @param known   the readings so far, without the one to be judged.
  /// @param reading with the point that it is meant to be of.
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
  std::vector<Eigen::Vector3d> directions_;  // that the field may have in the table, about
};

}  // namespace axiscal
