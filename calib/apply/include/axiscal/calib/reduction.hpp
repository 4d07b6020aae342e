// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

struct ReductionOptions {
  /// Magnitude F of the field at the place of the readings [unit of the results]. If it is nullopt,
  /// the F of the record is used.
  std::optional<double> magnitude;
  double factor = 1.0;  ///< FieldConversion::factor: results = factor * field in the record's unit
  InclinationOptions inclination;  ///< options for angles; the record's convention is always used
  double declination_rad = 0.0;    ///< magnetic declination, which is added to magnetic headings
};

/// The field at the place of the readings.
struct FieldAtReadings {
  /// Magnitude F of the field [unit of the results]. If it is nullopt, F is the magnitude of the
  /// record's field; for gravity that is converted to another unit or place, F is 1 g or
  /// `gravity_m_s2`.
  std::optional<double> magnitude;
  double magnitude_u = 0.0;            ///< standard uncertainty of F [unit of the results]
  std::optional<double> gravity_m_s2;  ///< gravity; if nullopt, gravity at the record's site
  double gravity_u_m_s2 = 0.0;         ///< standard uncertainty of `gravity_m_s2`
};

/// The unit of the results, and the field's magnitude at the place of the readings.
struct FieldConversion {
  std::string unit;
  double factor = 1.0;     ///< results = factor * field in the record's unit
  double magnitude = 1.0;  ///< F at the place of the readings [unit]
  /// Relative standard uncertainty of a field component, due to the uncertain magnitudes of the
  /// fields at the record's site and at the place of the readings. It is 0 if the unit of the
  /// results is `g` of the record's site.
  double component_u = 0.0;
  /// Relative standard uncertainty of the ratio of a component to F, which is used for angles and
  /// residuals. It is 0 if the readings are taken in the field of the calibration.
  double ratio_u = 0.0;
};

/// Computes the conversion of a record to another unit, or to the field at another site.
///
/// Units of the same quantity can be converted (nT, uT, T; rad/s, deg/s, deg/h). If gravity is
/// known at both sites, results can be converted between m/s^2, `g` at the site of the record and
/// `g` at the other site.
///
/// @param field      the field of the record.
/// @param unit       unit of the results. If it is empty, the unit of the record is used.
/// @param there      the field at the place of the readings; by default the field of the record.
/// @throws DomainError  if the units cannot be converted, or if a record in `g` lacks the gravity
///                      of its site.
[[nodiscard]] AXISCAL_EXPORT FieldConversion field_conversion(const FieldDescription& field,
                                                              const std::string& unit,
                                                              const FieldAtReadings& there = {});

/// Converts a calibration to the unit of `conversion`.
/// @param conversion  the result of field_conversion(); its magnitude becomes the magnitude of the
///                    record's field.
[[nodiscard]] AXISCAL_EXPORT Calibration converted(Calibration calibration,
                                                   const FieldConversion& conversion);

/// Converts a calibration to the frame of its assembly. All instruments of the assembly then give
/// the field in the same frame, even if one of them is turned in an H-shaped frame. A record
/// without an assembly is returned unchanged.
[[nodiscard]] AXISCAL_EXPORT Calibration in_assembly_frame(Calibration calibration);

/// The inputs of a reduction besides the readings.
struct ReadingContext {
  /// Specific force at rest in the sensor's frame, from an accelerometer. For headings it may be in
  /// any unit. If the record has a second field (option --also), its response to this field is
  /// subtracted, and `up` must be in the unit of this field.
  std::optional<Eigen::Vector3d> up;
  /// Output of the temperature sensor, for a record with temperature terms. If it is nullopt, the
  /// reference temperature of the calibration is used.
  std::optional<SensorTemperature> temperature;
  /// Covariance of `up` [unit of `up`, squared], for uncertainties.
  std::optional<Eigen::Matrix3d> up_covariance;
};

/// The result of a reading of three or more axes.
struct AXISCAL_EXPORT ReducedReading {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< measured field f_hat [field unit]
  double residual = 0.0;      ///< |f_hat| - F [field unit]; NaN if the biases contain the field
  DerivedValues derived;      ///< results of InstrumentKind::derive; NaN if residual is NaN
  bool determined = true;     ///< false if fewer than three one-sided axes face the light
  bool extrapolated = false;  ///< true if the temperature is outside the calibrated range
  std::span<const std::string_view> derived_names;  ///< names of the values in `derived`

  /// @param name  "x", "y" or "z" for a component of the field, "residual", or the name of a
  ///              derived value, for example "pitch_deg".
  /// @return the value of that name.
  /// @throws DomainError  if the name is unknown; the message lists the names.
  [[nodiscard]] double operator[](std::string_view name) const;
};

/// The result of a reading of one axis, for an instrument with fewer than three axes.
struct ReducedAxis {
  double component = 0.0;  ///< field along the sensing axis [field unit]
  /// Elevation of the axis above the horizontal; 0 if the kind of instrument has no elevation, NaN
  /// if the bias contains the field.
  double angle_rad = 0.0;
  bool clamped = false;
  bool extrapolated = false;
};

/// Converts readings to the field in the sensor's frame, to the residual of its magnitude, and to
/// results such as pitch and roll (for an accelerometer) or heading (for a magnetometer). This
/// conversion is called reduction.
///
///     f_hat = S^-1 T_s (v - b(t)),   T_s = diag(1 / scale_k(t))
///
/// Here v is the reading, S is the sensitivity matrix, b(t) is the bias at the temperature t, and
/// scale_k(t) is the relative sensitivity of axis k. Without temperature terms, T_s is the
/// identity. The result depends on the number m of axes:
///
/// - m >= 3: reduce() for one reading, reduce_rows() for a matrix of readings. If m > 3, the
///   field is a least-squares solution with the weights scale_k^2 / s_k^2, where s_k is the
///   residual standard deviation of axis k. A one-sided axis (photodiode) is used only if the
///   computed field is in front of the axis.
/// - m < 3: reduce_axis() gives the component along each axis. Two axes of a sun sensor
///   determine the whole direction, see closed_field().
///
/// If the biases of a record contain the field (gives_field() is false), f_hat is only the
/// difference between the reading and the bias. It has no residual and no direction.
///
/// A reducer does not change after its construction, so several threads may share one. reduce()
/// does not allocate memory and takes constant time; it can be used in real time.
///
/// @code
/// const axiscal::Reducer reduce(axiscal::read_calibration("cal.json"));
/// const double pitch_deg = reduce(std::array{0.01, -0.02, 0.99})["pitch_deg"];  // one reading
/// const Eigen::MatrixX3d fields = reduce.reduce_rows(volts);                    // n x 3
/// @endcode
///
/// @par Source
/// method.md, section 7; US 7,467,536.
class AXISCAL_EXPORT Reducer {
 public:
  /// @throws DomainError  if there are three or more axes but the rank of S is below 3, if the
  ///                      sensitivity of an axis is zero, or if the magnitude is not positive.
  explicit Reducer(const SensorModel& sensor, const ReductionOptions& options = {});

  /// A reducer that also uses the statistics of the record. If m > 3, the weights of the axes come
  /// from their residual standard deviations. If the biases contain the field (gives_field() is
  /// false), the residual and the derived values are NaN.
  /// @throws RefusedError  if the calibration was refused and `force` is `no`.
  explicit Reducer(const Calibration& calibration,
                   const ReductionOptions& options = {},
                   Force force = Force::no);

  /// @return m, the number of readings that reduce() takes.
  [[nodiscard]] std::size_t axis_count() const { return bias_.size(); }

  /// @return true if there are three or more axes, so that reduce() may be called.
  [[nodiscard]] bool gives_components() const { return bias_.size() >= 3; }

  [[nodiscard]] const InstrumentKind& kind() const { return *kind_; }

  /// @return F, the field's magnitude for residuals and angles [field unit].
  [[nodiscard]] double magnitude() const { return magnitude_; }

  /// Reduces one reading of three or more axes.
  ///
  /// @param readings  m finite readings [unit], in the order of the axes.
  /// @param context   additional inputs: the temperature if needs_temperature() is true, and the
  ///                  upward vertical for headings.
  /// @throws DomainError  if there are not axis_count() readings, or fewer than three.
  [[nodiscard]] ReducedReading reduce(std::span<const double> readings,
                                      const ReadingContext& context = {}) const;

  /// Short form of reduce(): `reduce(volts)["pitch_deg"]`.
  [[nodiscard]] ReducedReading operator()(std::span<const double> readings,
                                          const ReadingContext& context = {}) const {
    return reduce(readings, context);
  }

  /// Reduces a matrix of readings of three or more axes.
  ///
  /// @param readings      n x m, a row for each reading [unit].
  /// @param temperatures  n x 1, or n x m if each axis has its own temperature sensor. If it is
  ///                      empty, the reference temperature is used.
  /// @return n x 3, the field in the sensor's frame for each row [field unit]. It is NaN if the row
  ///         does not determine the field. Apart from rounding, the result equals the result of
  ///         reduce().
  /// @throws DomainError  if the sizes disagree, or if m is below three.
  [[nodiscard]] Eigen::MatrixX3d reduce_rows(
      const Eigen::Ref<const Eigen::MatrixXd>& readings,
      const Eigen::Ref<const Eigen::MatrixXd>& temperatures = Eigen::MatrixXd()) const;

  /// @return true if the record has temperature terms; then reduce() needs a temperature.
  [[nodiscard]] bool needs_temperature() const { return temperature_.has_value(); }

  /// @return true if reduce() needs a temperature for each axis.
  [[nodiscard]] bool has_own_temperatures() const {
    return temperature_ && temperature_->has_own_sensors();
  }

  /// @return true if a reading is at or beyond the range of its axis.
  [[nodiscard]] bool is_saturated(double reading) const noexcept {
    return range_ && (reading <= range_->low || reading >= range_->high);
  }

  /// Converts a reading of one axis to the component of the field along this axis, (v - b) / |S_k|.
  /// It may be called for any number of axes.
  ///
  /// @param axis     0 .. m - 1.
  /// @param reading      the axis's reading [unit], finite.
  /// @param temperature  as in reduce().
  [[nodiscard]] ReducedAxis reduce_axis(
      std::size_t axis,
      double reading,
      const std::optional<SensorTemperature>& temperature = {}) const noexcept;

  /// @return |S_k|, the change of the axis's reading for a change of the field along the axis by
  ///         one unit of the results.
  [[nodiscard]] double sensitivity_of(std::size_t axis) const { return length_[axis]; }

  /// @return true for a sun sensor with two axes: it determines the whole field. The third
  ///         component follows from the magnitude F, and it is positive because the sensor sees
  ///         only one side.
  [[nodiscard]] bool completes_third_component() const { return open_direction_.has_value(); }

  /// The field from two measured components and the magnitude F.
  struct ClosedField {
    Eigen::Vector3d in_sensor = Eigen::Vector3d::Zero();  ///< f_hat [field unit]
    bool clamped = false;  ///< true if the two components together exceed F; the third is then 0
  };

  /// Computes the field from two measured components. The third component is sqrt(F^2 -
  /// |measured|^2), along the cross product of the first and the second sensing axis.
  ///
  /// @param first, second  readings of the two axes [unit], finite.
  /// @param temperature    as in reduce().
  /// @throws DomainError  unless completes_third_component().
  [[nodiscard]] ClosedField closed_field(
      double first, double second, const std::optional<SensorTemperature>& temperature = {}) const;

 private:
  // The data of a record that are not in its sensor model.
  struct Knowledge {
    Eigen::VectorXd weights;  // weight of each axis's equation
    bool gives_field = true;
  };
  Reducer(const SensorModel& sensor, const Knowledge& knowledge, const ReductionOptions& options);

  void require_components(Eigen::Index readings) const;
  // Computes f_hat for three or more axes. Returns false if the readings do not determine it.
  bool solve(std::span<const double> readings,
             const ReadingContext& context,
             Eigen::Vector3d& field) const noexcept;
  // Computes the fields for an instrument of three axes, by the vector kernel reduce_columns().
  void reduce_plain(const Eigen::Ref<const Eigen::MatrixXd>& readings,
                    Eigen::MatrixX3d& fields) const;

  const InstrumentKind* kind_;
  double magnitude_;
  InclinationOptions inclination_;
  std::vector<double> bias_;
  std::vector<double> length_;            // |S_k|
  std::vector<Eigen::Vector3d> inverse_;  // columns of the pseudo-inverse of S
  [[nodiscard]] bool solve_light(std::span<const double> readings,
                                 const std::optional<SensorTemperature>& temperature,
                                 Eigen::Vector3d& field) const noexcept;

  // Returns T_s (v - b(t)) for one axis.
  [[nodiscard]] double bias_corrected(
      std::size_t axis,
      double reading,
      const std::optional<SensorTemperature>& temperature) const noexcept;
  [[nodiscard]] bool solve_scaled(std::span<const double> readings,
                                  const std::optional<SensorTemperature>& temperature,
                                  Eigen::Vector3d& field) const noexcept;

  bool gives_field_ = true;
  bool one_sided_ = false;
  std::optional<Eigen::Vector3d> open_direction_;  // direction of the third component if m = 2
  std::vector<Eigen::Vector3d> rows_;  // rows of S, if the inverse depends on the reading
  std::vector<double> weights_;        // weights of the equations of rows_
  std::optional<TemperatureResponse> temperature_;
  // For each second field (option --also): the apparent field that one unit of the second field
  // causes.
  std::vector<Eigen::Matrix3d> also_;
  std::optional<ReadingRange> range_;
  double factor_ = 1.0;
  double declination_rad_ = 0.0;
};

}  // namespace axiscal
