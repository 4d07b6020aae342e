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
  double resolution = 0.0;  ///< smallest step of a reading [unit]; its error is uniform
  /// Standard uncertainty of the temperature output [unit of the output].
  double temperature_u = 0.0;
};

/// @return the resolution and the temperature output's uncertainty that a record states. `sd` is
///         nullopt, so the scatter of the fit is used.
[[nodiscard]] AXISCAL_EXPORT ReadingNoise stated_noise(const Calibration& calibration);

/// Uncertainties of a reading's results, in their units.
struct AXISCAL_EXPORT UncertaintyOfResults {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< [field unit]
  double residual = 0.0;
  std::array<double, DerivedValues{}.values.size()> derived{};  ///< NaN if the value is NaN
};

/// Standard and expanded uncertainties of a reading's results.
struct ReducedUncertainty : UncertaintyOfResults {
  /// Half widths of the intervals with the constructor's probability.
  UncertaintyOfResults expanded;
};

/// @param field  the field at the reading, frame sensor [field unit of the record].
/// @return derivative of a reading with respect to the calibration's parameters, m x p, in the
///         order of their names.
/// @throws DomainError  if the record lacks statistics.
[[nodiscard]] AXISCAL_EXPORT Eigen::MatrixXd change_with_parameters(const Calibration& calibration,
                                                                    const Eigen::Vector3d& field,
                                                                    const ReadingContext& context);

class ReadingPropagation;

/// @param propagation  the propagation with the same record.
/// @param direction    direction of the field: unit vector, frame sensor.
/// @return the expanded uncertainty (95 %) of the measured field's direction [deg], as an angle
///         about the axis with the largest uncertainty.
[[nodiscard]] AXISCAL_EXPORT double direction_uncertainty_deg(const Calibration& calibration,
                                                              const ReadingPropagation& propagation,
                                                              const Eigen::Vector3d& direction);

/// Propagates the uncertainties of a calibration and of a reading to field components and to
/// derived quantities, in any attitude (method.md, section 8).
///
/// An error of the parameters acts like an error of the readings. If C is the covariance of the
/// parameters and B = dv / d(parameters) at the measured field, this error has the covariance
/// B C B^T. The derivative of the results with respect to the readings is a difference over a step
/// as large as the readings' uncertainty, so that it is valid for angles that are not linear in the
/// readings. An error of the field's magnitude cancels in angles if the readings are taken in the
/// field of the calibration.
///
/// @code
/// const axiscal::ReadingPropagation propagation(calibration, reducer);
/// const axiscal::ReducedUncertainty u = propagation.at(std::array{0.01, -0.02, 0.99});
/// @endcode
class AXISCAL_EXPORT ReadingPropagation {
 public:
  /// @param calibration  a record with statistics and a covariance.
  /// @param reducer      a reducer of the same record; must outlive this object.
  /// @param noise        the uncertainties of new readings.
  /// @param factor       ReductionOptions::factor of the reducer.
  /// @param probability  coverage probability of the expanded uncertainties.
  /// @throws DomainError  if the record lacks the covariance of its parameters, if the scatter is
  ///                      missing in the record and the sd is missing in `noise`, or if the
  ///                      probability is not between 0 and 1.
  ReadingPropagation(const Calibration& calibration,
                     const Reducer& reducer,
                     const ReadingNoise& noise = {},
                     double factor = 1.0,
                     double probability = 0.95);

  /// Sets the relative uncertainties component_u and ratio_u from a conversion to another site.
  /// Without this call, the readings are assumed to be taken in the field of the calibration.
  void set_field_u(const FieldConversion& conversion) {
    component_u_ = conversion.component_u;
    ratio_u_ = conversion.ratio_u;
  }

  /// States that `up` comes from an instrument that was calibrated in the same cube. An error of
  /// the cube's face normals changes both instruments' fields, so the errors of the two fields are
  /// correlated.
  void share_cube();

  /// @param readings, context  see Reducer::reduce().
  [[nodiscard]] ReducedUncertainty at(std::span<const double> readings,
                                      const ReadingContext& context = {}) const;

  /// The length of the measured field, with its derivative and its variance.
  struct LengthChange {
    double length = 0.0;  ///< |f| [field unit of the record]
    Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
    /// d|f| / d(parameters), one entry for each parameter [field unit per unit of the parameter].
    Eigen::RowVectorXd by_parameters;
    /// Variance of the length from the reading's noise [field unit squared].
    double reading_variance = 0.0;
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
    double coverage_factor = 0.0;  ///< coverage factor of both, for the constructor's probability
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
  // The variance of a new block's readings in `field` about the mean of the record's blocks: m
  // entries [unit^2]. It is 0 if the record has only one block.
  [[nodiscard]] Eigen::VectorXd between_blocks(const Eigen::Vector3d& field) const;
  void find_scatter_of_blocks();
  void add_blocks(const Eigen::RowVectorXd& gradient,
                  const Eigen::VectorXd& between,
                  VarianceShares& shares) const;

  // The variance of a reading from noise, resolution and temperature output, without the
  // calibration's uncertainty: m entries [unit^2].
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

  // A part of the parameters' covariance, with its degrees of freedom.
  struct Part {
    Eigen::MatrixXd covariance;
    double degrees_of_freedom = 0.0;
  };

  // The variance of a result, split by source.
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
  Eigen::MatrixXd block_variance_;  // m x 4: variance of bias and sensitivities, without noise
  double block_freedom_ = 0.0;
  double factor_;
  CoverageFactors factors_;
  double component_u_ = 0.0;      // FieldConversion::component_u
  double ratio_u_ = 0.0;          // FieldConversion::ratio_u
  Eigen::MatrixXd covariance_;    // covariance of the parameters, without the error of F
  Eigen::MatrixXd of_readings_;   // the part of covariance_ from the readings' scatter
  Eigen::MatrixXd of_inputs_;     // the part of covariance_ from type B sources
  std::vector<Part> components_;  // the parts of covariance_ from blocks, seats, ...
  // One of the independent errors of the cube that also affect `up`: dS, its effect on S, and
  // S^-1 dS.
  struct CubeError {
    SensitivityMatrix of_sensitivity;
    Eigen::Matrix3d of_field;
  };
  std::vector<CubeError> cube_errors_;
};

/// One quantity of an uncertainty budget, in one attitude.
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
/// @param temperature      temperature of the sensor; default: the calibration's reference.
/// @throws DomainError  as ReadingPropagation, and for fewer than three axes.
[[nodiscard]] AXISCAL_EXPORT AttitudeBudget attitude_budget(const Calibration& calibration,
                                                            const ReductionOptions& options,
                                                            const ReadingNoise& noise,
                                                            const Eigen::Vector3d& field_in_sensor,
                                                            std::optional<double> temperature = {});

/// @return the field in the sensor's frame at this pitch and roll [field unit of the record].
[[nodiscard]] AXISCAL_EXPORT Eigen::Vector3d field_of_attitude(const SensorModel& sensor,
                                                               double pitch_rad,
                                                               double roll_rad);

/// The comparison of the linear propagation with a Monte Carlo simulation (JCGM 101), for one
/// quantity.
struct MonteCarloCheck {
  std::string name;
  double linear_u = 0.0;
  double linear_expanded = 0.0;
  double mean_error = 0.0;  ///< mean of the simulated results minus the true value
  double sd = 0.0;
  /// low_95 .. high_95: 95 % interval of the errors, symmetric in probability.
  double low_95 = 0.0;
  double high_95 = 0.0;
  bool agrees = true;  ///< |low_95| and high_95 both equal linear_expanded within 10 %
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
