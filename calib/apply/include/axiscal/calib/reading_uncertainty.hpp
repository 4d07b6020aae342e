// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Uncertainties of new readings, without the uncertainty of the calibration.
struct ReadingNoise {
  /// Standard deviation of one reading [unit], for each axis; default: the fit's residual_sd, with
  /// its degrees of freedom.
  std::optional<Eigen::VectorXd> sd;
  double resolution = 0.0;     ///< smallest step of a reading [unit]; its error is uniform
  double temperature_u = 0.0;  ///< standard uncertainty of the temperature output
};

/// @return the readings' uncertainties in a record: their resolution and the temperature output's
///         uncertainty. The scatter is that of the fit.
[[nodiscard]] AXISCAL_EXPORT ReadingNoise stated_noise(const Calibration& calibration);

/// Uncertainties of a reading's results, in their units.
struct AXISCAL_EXPORT UncertaintyOfResults {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< [field unit]
  double residual = 0.0;
  std::array<double, DerivedValues{}.values.size()> derived{};  ///< NaN if the value is NaN
};

/// Standard and expanded uncertainties of a reading's results.
struct ReducedUncertainty : UncertaintyOfResults {
  UncertaintyOfResults expanded;  ///< half widths of intervals of the stated probability
};

/// @param field  the field at the reading, frame sensor [field unit of the record].
/// @return derivative of a reading with respect to the calibration's parameters, m x p, in the
///         order of their names.
/// @throws DomainError  if the record lacks statistics.
[[nodiscard]] AXISCAL_EXPORT Eigen::MatrixXd change_with_parameters(const Calibration& calibration,
                                                                    const Eigen::Vector3d& field,
                                                                    const ReadingContext& context);

class ReadingPropagation;

/// @param propagation  of the same record.
/// @param direction    of the field, unit vector, frame sensor.
/// @return the expanded uncertainty (95 %) of the angle between the field and the result [deg],
///         about the axis with the largest uncertainty.
[[nodiscard]] AXISCAL_EXPORT double direction_uncertainty_deg(const Calibration& calibration,
                                                              const ReadingPropagation& propagation,
                                                              const Eigen::Vector3d& direction);

/// Propagates the uncertainties of a calibration and of a reading to field components and to
/// derived quantities, in any attitude (method.md, section 8).
///
/// An error of the parameters acts like an error of the readings with covariance B C B^T, where
/// B = dv / d(parameters) at the measured field. The derivative of the results with respect to the
/// readings is a difference over a step as large as the readings' uncertainty, so that it is valid
/// for angles that are not linear in the readings. The field's magnitude cancels in angles.
///
/// @code
/// const axiscal::ReadingPropagation propagation(calibration, reducer);
/// const axiscal::ReducedUncertainty u = propagation.at(std::array{0.01, -0.02, 0.99});
/// @endcode
class AXISCAL_EXPORT ReadingPropagation {
 public:
  /// @param calibration  with statistics and their covariance.
  /// @param reducer      of the same record; must outlive this.
  /// @param noise        of new readings.
  /// @param factor       ReductionOptions::factor of the reducer.
  /// @param probability  of the expanded uncertainties' intervals.
  /// @throws DomainError  if the record states no covariance of its parameters, if it states no
  ///                      scatter and `noise` has no sd, or if the probability is not between 0
  ///                      and 1.
  ReadingPropagation(const Calibration& calibration,
                     const Reducer& reducer,
                     const ReadingNoise& noise = {},
                     double factor = 1.0,
                     double probability = 0.95);

  /// Sets the uncertainties of the fields at both sites, as given by the conversion. Before this
  /// call, readings are taken in the calibration's field.
  void set_field_u(const FieldConversion& conversion) {
    component_u_ = conversion.component_u;
    ratio_u_ = conversion.ratio_u;
  }

  /// States that `up` comes from an instrument that was calibrated in the same cube. An error of
  /// the cube's face normals turns both fields by the same amount, so the errors of both correlate.
  void share_cube();

  /// @param readings, context  as Reducer::reduce().
  [[nodiscard]] ReducedUncertainty at(std::span<const double> readings,
                                      const ReadingContext& context = {}) const;

  /// The length of the measured field, with its derivative and its variance.
  struct LengthChange {
    double length = 0.0;  ///< |f| [field unit of the record]
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    Eigen::RowVectorXd by_parameters;  ///< p: d|f| / d(parameters) [field unit per unit of each]
    double reading_variance = 0.0;     ///< by the scatter of the readings [field unit squared]
  };
  [[nodiscard]] LengthChange length_change(
      std::span<const double> readings,
      const std::optional<SensorTemperature>& temperature = {}) const;

  /// Covariance of the field's components [field unit squared].
  [[nodiscard]] Eigen::Matrix3d field_covariance(
      std::span<const double> readings,
      const std::optional<SensorTemperature>& temperature = {}) const;

  /// Standard uncertainties for one axis of an instrument with fewer than three axes. The field
  /// perpendicular to the axis is unknown; its length is at most F.
  struct Axis {
    double component = 0.0;  ///< [field unit]
    double angle_rad = 0.0;
    double coverage_factor = 0.0;  ///< of both, for the probability of the constructor
  };
  [[nodiscard]] Axis at_axis(std::size_t axis,
                             double reading,
                             const std::optional<SensorTemperature>& temperature = {}) const;

 private:
  friend class AttitudeBudgetMaker;

  [[nodiscard]] Eigen::MatrixXd change_with_parameters(const Eigen::Vector3d& field,
                                                       const ReadingContext& context) const {
    return axiscal::change_with_parameters(calibration_, field, context);
  }
  // The variance of readings of another block about the mean of the record's blocks, at a field: m
  // entries [unit^2]. It is 0 if the record has one block.
  [[nodiscard]] Eigen::VectorXd between_blocks(const Eigen::Vector3d& field) const;
  void find_scatter_of_blocks();
  void add_blocks(const Eigen::RowVectorXd& gradient,
                  const Eigen::VectorXd& between,
                  VarianceShares& shares) const;

  // The variance of a reading without that of the calibration: m entries [unit^2].
  [[nodiscard]] Eigen::VectorXd reading_variance(
      const Eigen::Vector3d& field, const std::optional<SensorTemperature>& temperature) const;
  [[nodiscard]] Eigen::MatrixXd change_with_readings(std::span<const double> readings,
                                                     const ReadingContext& context,
                                                     const Eigen::VectorXd& step) const;

  void add_magnitude(const ReducedReading& reduced,
                     std::span<const double> readings,
                     const ReadingContext& context,
                     std::vector<VarianceShares>& shares) const;
  void put_pole(ReducedUncertainty& result) const;

  // A covariance of the parameters with its degrees of freedom.
  struct Part {
    Eigen::MatrixXd covariance;
    double degrees_of_freedom = 0.0;
  };

  // The variance of a result by its sources.
  // @param gradient          derivative of the result with respect to the readings.
  // @param B                 change_with_parameters().
  // @param reading_variance  m entries.
  [[nodiscard]] VarianceShares shares_of(const Eigen::RowVectorXd& gradient,
                                         const Eigen::MatrixXd& B,
                                         const Eigen::VectorXd& reading_variance) const;

  const Calibration& calibration_;
  const Reducer& reducer_;
  ReadingNoise noise_;
  Eigen::VectorXd sd_;
  Eigen::MatrixXd block_variance_;  // m x 4: of bias and sensitivities, without readings' noise
  double block_freedom_ = 0.0;
  double factor_;
  CoverageFactors factors_;
  double component_u_ = 0.0;      // FieldConversion::component_u
  double ratio_u_ = 0.0;          // FieldConversion::ratio_u
  Eigen::MatrixXd covariance_;    // of the parameters, without the part of the field's magnitude
  Eigen::MatrixXd of_readings_;   // the part of covariance_ from the readings' scatter
  Eigen::MatrixXd of_inputs_;     // the part of covariance_ from type B sources
  std::vector<Part> components_;  // the parts of covariance_ from blocks, seats, ...
  // An independent error of the cube that `up` shares: its effect dS on S, and S^-1 dS.
  struct CubeError {
    SensitivityMatrix of_sensitivity;
    Eigen::Matrix3d of_field;
  };
  std::vector<CubeError> cube_errors_;
};

/// One quantity in one attitude, as in an uncertainty budget.
struct AttitudeQuantity {
  std::string name;  ///< "field_x", "pitch_deg", ...
  double value = 0.0;
  CombinedUncertainty uncertainty;  ///< by_source is in the order of AttitudeBudget::sources
};

/// The uncertainty budget of one reading in an attitude.
struct AttitudeBudget {
  std::vector<std::string> sources;  ///< the calibration's, then "reading", "resolution", ...
  std::vector<AttitudeQuantity> quantities;
};

/// @param field_in_sensor  the field that is read [field unit of the record].
/// @param temperature      of the sensor; default: the calibration's reference.
/// @throws DomainError  as ReadingPropagation, and for fewer than three axes.
[[nodiscard]] AXISCAL_EXPORT AttitudeBudget attitude_budget(const Calibration& calibration,
                                                            const ReductionOptions& options,
                                                            const ReadingNoise& noise,
                                                            const Eigen::Vector3d& field_in_sensor,
                                                            std::optional<double> temperature = {});

/// @return the field of a pitch and roll in the sensor's frame [field unit of the record].
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d field_of_attitude(const SensorModel& sensor,
                                                               double pitch_rad,
                                                               double roll_rad);

/// Tests the validity of the linear propagation by Monte Carlo (JCGM 101).
struct MonteCarloCheck {
  std::string name;
  double linear_u = 0.0;
  double linear_expanded = 0.0;
  double mean_error = 0.0;  ///< distance of the results' mean from the value
  double sd = 0.0;
  double low_95 = 0.0;  ///< probabilistically symmetric interval of the errors
  double high_95 = 0.0;
  bool agrees = true;  ///< both ends agree with linear_expanded within a tenth
};

/// Draws parameters and readings from their distributions (Student's t for estimated scatter),
/// reduces the readings, and compares the spread of the results with attitude_budget().
/// @param trials  at least 1000.
/// @throws DomainError  as attitude_budget(), and for fewer trials.
[[nodiscard]] AXISCAL_EXPORT std::vector<MonteCarloCheck> check_by_monte_carlo(
    const Calibration& calibration,
    const ReductionOptions& options,
    const ReadingNoise& noise,
    const Eigen::Vector3d& field_in_sensor,
    int trials,
    std::uint64_t seed,
    std::optional<double> temperature = {});

}  // namespace axiscal
