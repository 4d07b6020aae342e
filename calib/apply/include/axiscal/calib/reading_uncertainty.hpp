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
  /// Standard deviation of one reading [unit], for each axis. If it is nullopt, the fit's
  /// residual_sd is used, with the degrees of freedom of the fit.
  std::optional<Eigen::VectorXd> sd;
  /// Smallest step of a reading [unit]. The rounding error is taken as uniformly distributed.
  double resolution = 0.0;
  /// Standard uncertainty of the temperature sensor's output [unit of the output].
  double temperature_u = 0.0;
};

/// @return the resolution and the temperature uncertainty that a record states. `sd` is nullopt, so
///         that the scatter of the fit is used.
[[nodiscard]] AXISCAL_EXPORT ReadingNoise stated_noise(const Calibration& calibration);

/// Uncertainties of a reading's results, each in the unit of the result.
struct AXISCAL_EXPORT UncertaintyOfResults {
  /// Uncertainties of the field's components [field unit].
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();
  double residual = 0.0;
  /// Uncertainties of the derived values; NaN if the derived value itself is NaN.
  std::array<double, DerivedValues{}.values.size()> derived{};
};

/// Standard and expanded uncertainties of a reading's results.
struct ReducedUncertainty : UncertaintyOfResults {
  /// Expanded uncertainties: half widths of the intervals with the probability that was given to
  /// the constructor of ReadingPropagation.
  UncertaintyOfResults expanded;
};

/// @param field  the field at the reading, frame sensor [field unit of the record].
/// @return derivative of the reading with respect to the calibration's parameters, m x p, in the
///         order of the parameters' names.
/// @throws DomainError  if the record lacks statistics.
[[nodiscard]] AXISCAL_EXPORT Eigen::MatrixXd change_with_parameters(const Calibration& calibration,
                                                                    const Eigen::Vector3d& field,
                                                                    const ReadingContext& context);

class ReadingPropagation;

/// @param propagation  the propagation with the same record.
/// @param direction    direction of the field: unit vector, frame sensor.
/// @return the expanded uncertainty (95 %) of the direction of the measured field [deg]. It is the
///         largest value over all rotation axes perpendicular to `direction`.
[[nodiscard]] AXISCAL_EXPORT double direction_uncertainty_deg(const Calibration& calibration,
                                                              const ReadingPropagation& propagation,
                                                              const Eigen::Vector3d& direction);

/// Propagates the uncertainties of a calibration and of a reading to field components and to
/// derived quantities, in any attitude (method.md, section 8).
///
/// An error of the parameters acts like an error of the readings. If C is the covariance of the
/// parameters and B = dv / d(parameters) is the derivative of the readings v at the measured field,
/// the equivalent error of the readings has the covariance B C B^T. The derivative of the results
/// with respect to the readings is a difference over a step as large as the readings' uncertainty,
/// so that it is valid for angles that are not linear in the readings. An error of the field's
/// magnitude cancels in angles if the readings are taken in the field of the calibration.
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
  /// @param factor       the ReductionOptions::factor that was given to the reducer.
  /// @param probability  coverage probability of the expanded uncertainties.
  /// @throws DomainError  if the record lacks the covariance of its parameters, if neither the
  ///                      record nor `noise` states the scatter of the readings, or if the
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

  /// Call this if `up` comes from an instrument that was calibrated in the same cube. An error of
  /// the cube's face normals affects both calibrations, so the errors of this instrument's field
  /// and of `up` are correlated.
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
    /// Variance of the length that is due to the noise of the reading [field unit squared].
    double reading_variance = 0.0;
  };
  [[nodiscard]] LengthChange length_change(
      std::span<const double> readings,
      const std::optional<SensorTemperature>& temperature = {}) const;

  /// Covariance of the field's components [field unit squared].
  [[nodiscard]] Eigen::Matrix3d field_covariance(
      std::span<const double> readings,
      const std::optional<SensorTemperature>& temperature = {}) const;

  /// Standard uncertainties for one axis of an instrument with fewer than three axes. The field's
  /// component perpendicular to the axis is unknown, but does not exceed the magnitude F.
  struct Axis {
    double component = 0.0;  ///< uncertainty of the component along the axis [field unit]
    double angle_rad = 0.0;
    double coverage_factor = 0.0;  ///< coverage factor for component and angle
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
  // Returns the variance between blocks, m entries [unit^2]: the variance of the readings of a new
  // block in the field `field`, about the mean of the record's blocks. It is 0 if the record has
  // only one block.
  [[nodiscard]] Eigen::VectorXd between_blocks(const Eigen::Vector3d& field) const;
  void find_scatter_of_blocks();
  void add_blocks(const Eigen::RowVectorXd& gradient,
                  const Eigen::VectorXd& between,
                  VarianceShares& shares) const;

  // Returns the variance of a reading due to noise, resolution and temperature, without the
  // uncertainty of the calibration: m entries [unit^2].
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

  // Returns the variance of a result, split by source.
  // @param gradient          derivative of the result with respect to the readings.
  // @param B                 the result of change_with_parameters().
  // @param reading_variance  the result of reading_variance(), m entries.
  [[nodiscard]] VarianceShares shares_of(const Eigen::RowVectorXd& gradient,
                                         const Eigen::MatrixXd& B,
                                         const Eigen::VectorXd& reading_variance) const;

  const Calibration& calibration_;
  const Reducer& reducer_;
  ReadingNoise noise_;
  Eigen::VectorXd sd_;
  // m x 4: variance of each axis's bias and sensitivities between blocks, without the part due to
  // noise.
  Eigen::MatrixXd block_variance_;
  double block_freedom_ = 0.0;
  double factor_;
  CoverageFactors factors_;
  double component_u_ = 0.0;     // FieldConversion::component_u
  double ratio_u_ = 0.0;         // FieldConversion::ratio_u
  Eigen::MatrixXd covariance_;   // covariance of the parameters, without the magnitude's error
  Eigen::MatrixXd of_readings_;  // part of covariance_ that is due to the scatter of readings
  Eigen::MatrixXd of_inputs_;    // part of covariance_ that is due to type B sources
  // Parts of covariance_ that are due to random differences between blocks, between placements of
  // the cube, and so on.
  std::vector<Part> components_;
  // The effect of one independent error of the cube, which also affects `up`. `of_sensitivity` is
  // the change dS of the sensitivities S. `of_field` is the product S^-1 dS.
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
  /// The sources of the calibration's uncertainty, then "reading" for the noise of the reading. If
  /// the record states the scatter between blocks, "later block" follows.
  std::vector<std::string> sources;
  std::vector<AttitudeQuantity> quantities;
};

/// Computes the uncertainty budget of a reading.
/// @param field_in_sensor  the field that the instrument reads [field unit of the record].
/// @param temperature      temperature of the sensor; default: the reference temperature of the
///                         calibration.
/// @throws DomainError  if ReadingPropagation throws it, or if there are fewer than three axes.
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
  double mean_error = 0.0;  ///< mean of the simulated results, minus the true value
  double sd = 0.0;
  /// The interval low_95 .. high_95 contains 95 % of the errors; 2.5 % are on each side of it.
  double low_95 = 0.0;
  double high_95 = 0.0;
  bool agrees = true;  ///< true if |low_95| and high_95 differ from linear_expanded by at most 10 %
};

/// Draws parameters and readings from their distributions (Student's t for estimated scatter),
/// reduces the readings, and compares the spread of the results with attitude_budget().
/// @param trials  at least 1000.
/// @throws DomainError  if attitude_budget() throws it, or if `trials` is too small.
[[nodiscard]] AXISCAL_EXPORT std::vector<MonteCarloCheck> check_by_monte_carlo(
    const Calibration& calibration,
    const ReductionOptions& options,
    const ReadingNoise& noise,
    const Eigen::Vector3d& field_in_sensor,
    int trials,
    std::uint64_t seed,
    std::optional<double> temperature = {});

}  // namespace axiscal
