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
  /// F at the place of the readings [unit of the results]; nullopt: the record's F.
  std::optional<double> magnitude;
  double factor = 1.0;  ///< FieldConversion::factor: results = factor * field in the record's unit
  InclinationOptions inclination;  ///< its convention is replaced by that of the record
  double declination_rad = 0.0;    ///< added to magnetic headings
};

/// The field at the place of the readings.
struct FieldAtReadings {
  std::optional<double> magnitude;     ///< F [unit of the results]; default: the record's, or 1 g
  double magnitude_u = 0.0;            ///< its standard uncertainty [unit of the results]
  std::optional<double> gravity_m_s2;  ///< gravity; nullopt: gravity at the record's site
  double gravity_u_m_s2 = 0.0;         ///< its standard uncertainty
};

/// The unit of the results, and the field's magnitude at the place of the readings.
struct FieldConversion {
  std::string unit;
  double factor = 1.0;     ///< results = factor * field in the record's unit
  double magnitude = 1.0;  ///< F at the place of the readings [unit]
  /// Relative standard uncertainty of a field component, from the uncertainties of the fields at
  /// the record's site and at the place of the readings. It is 0 if the unit of the results is `g`
  /// of the record's site.
  double component_u = 0.0;
  /// Relative standard uncertainty of a component divided by F, for angles and residuals. It is 0
  /// if the readings are taken in the field of the calibration.
  double ratio_u = 0.0;
};

/// The conversion of a record from the field of its site to the field at another site.
///
/// Units of one quantity convert to each other (nT, uT, T; rad/s, deg/s, deg/h). The gravity of the
/// two sites converts between `g` of a record, `g` of another site, and m/s^2.
///
/// @param field      the field of the record.
/// @param unit       unit of the results; empty: the record's unit.
/// @param there      the field at the place of the readings; by default that of the record.
/// @throws DomainError  if the units do not convert, or if a record in `g` lacks the gravity of its
/// site.
[[nodiscard]] AXISCAL_EXPORT FieldConversion field_conversion(const FieldDescription& field,
                                                              const std::string& unit,
                                                              const FieldAtReadings& there = {});

/// The calibration with its field converted to another unit.
/// @param conversion  the result of field_conversion(); its magnitude becomes the magnitude of the
///                    record's field.
[[nodiscard]] AXISCAL_EXPORT Calibration converted(Calibration calibration,
                                                   const FieldConversion& conversion);

/// The calibration in the frame of its assembly. All instruments of the assembly then give the
/// field in the same frame, also if one of them is turned in an H-shaped frame. A record without an
/// assembly is returned unchanged.
[[nodiscard]] AXISCAL_EXPORT Calibration in_assembly_frame(Calibration calibration);

/// Additional inputs besides the readings of an instrument.
struct ReadingContext {
  /// Specific force at rest in the sensor's frame, from an accelerometer. It is used for headings
  /// [any unit], and to subtract the response to a second field [unit of that field].
  std::optional<Eigen::Vector3d> up;
  /// Output of the temperature sensor, for a record with temperature terms; nullopt: the
  /// calibration's reference.
  std::optional<SensorTemperature> temperature;
  /// Covariance of `up`, for uncertainties [unit of up, squared].
  std::optional<Eigen::Matrix3d> up_covariance;
};

/// The result of a reading of three or more axes.
struct AXISCAL_EXPORT ReducedReading {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< f_hat [field unit]
  double residual = 0.0;      ///< |f_hat| - F [field unit]; NaN if the biases contain the field
  DerivedValues derived;      ///< by the kind of instrument; NaN if the biases contain the field
  bool determined = true;     ///< false if fewer than three one-sided axes face the light
  bool extrapolated = false;  ///< the temperature is outside the calibrated range
  std::span<const std::string_view> derived_names;  ///< names of the values in `derived`

  /// @param name  "x", "y", "z" of the field, "residual", or a derived value of the kind of
  ///              instrument, for example "pitch_deg".
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

/// Converts readings to the field in the sensor's frame, to its residual, and to the quantities
/// that the kind of instrument derives: pitch and roll of an accelerometer, heading of a
/// magnetometer.
///
///     f_hat = S^-1 T_s (v - b(t)),   T_s = diag(1 / scale_k(t))
///
/// Without temperature terms, T_s is the identity. The result depends on the number m of axes:
///
/// - m >= 3: reduce() for one reading, reduce_rows() for a matrix of readings. If m > 3, the
///   field is a least-squares solution with the weights scale_k^2 / s_k^2, where s_k is the
///   residual standard deviation of axis k. A one-sided axis (photodiode) is used only if the
///   reduced field is in front of the axis.
/// - m < 3: reduce_axis() gives the component along each axis. Two axes of a sun sensor
///   determine the whole direction, see closed_field().
///
/// If the biases of a record contain the field (gives_field()), f_hat is only the difference
/// between a reading and bias(t); it does not have a residual or a direction.
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
  /// @throws DomainError  if m >= 3 axes do not determine the field (the rank of S is below 3), if
  ///         the sensitivity of an axis is zero, or if the magnitude is not positive.
  explicit Reducer(const SensorModel& sensor, const ReductionOptions& options = {});

  /// A reducer that also uses the statistics of the record. If m > 3, the weights of the axes come
  /// from their residual standard deviations. The residual and the derived values are NaN if the
  /// biases contain the field (gives_field()).
  /// @throws RefusedError  if the calibration was refused and `force` is `no`.
  explicit Reducer(const Calibration& calibration,
                   const ReductionOptions& options = {},
                   Force force = Force::no);

  /// @return m, the number of readings that reduce() takes.
  [[nodiscard]] std::size_t axis_count() const { return bias_.size(); }

  /// @return true if reduce() may be called: three or more axes.
  [[nodiscard]] bool gives_components() const { return bias_.size() >= 3; }

  [[nodiscard]] const InstrumentKind& kind() const { return *kind_; }

  /// @return F, the field's magnitude for residuals and angles [field unit].
  [[nodiscard]] double magnitude() const { return magnitude_; }

  /// Reduces one reading of three or more axes.
  ///
  /// @param readings  m finite readings [unit], in the order of the axes.
  /// @param context   additional inputs: the temperature if needs_temperature() (the default is the
  ///                  calibration's reference), and the direction up for headings.
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
  /// @param temperatures  n x 1, or n x m if each axis has a sensor; empty: the reference.
  /// @return n x 3, the field in the sensor's frame for each row [field unit]; NaN if the row does
  ///         not determine it. Apart from rounding, the result is that of reduce().
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

  /// Reduces a reading of one axis to the component of the field along it, (v - b) / |S_k|. It
  /// works for any m.
  ///
  /// @param axis     0 .. m - 1.
  /// @param reading      the axis's reading [unit], finite.
  /// @param temperature  as in reduce().
  [[nodiscard]] ReducedAxis reduce_axis(
      std::size_t axis,
      double reading,
      const std::optional<SensorTemperature>& temperature = {}) const noexcept;

  /// @return |S_k|, the increase of an axis's reading if the field along the axis grows by one unit
  ///         of the results.
  [[nodiscard]] double sensitivity_of(std::size_t axis) const { return length_[axis]; }

  /// @return true if two axes determine the whole field: the third component follows from the
  ///         magnitude F, and its sign from the fact that the sensor responds only to one side (a
  ///         sun sensor).
  [[nodiscard]] bool completes_third_component() const { return open_direction_.has_value(); }

  /// The field from two measured components and the magnitude F.
  struct ClosedField {
    Eigen::Vector3d in_sensor = Eigen::Vector3d::Zero();  ///< f_hat [field unit]
    bool clamped = false;  ///< true if both components exceed F, so that the third is 0
  };

  /// The field from two measured components. The third one is sqrt(F^2 - |measured|^2), along the
  /// cross product of the first and the second sensing axis.
  ///
  /// @param first, second  readings of the two axes [unit], finite.
  /// @param temperature    as in reduce().
  /// @throws DomainError  unless completes_third_component().
  [[nodiscard]] ClosedField closed_field(
      double first, double second, const std::optional<SensorTemperature>& temperature = {}) const;

 private:
  // Data of the record in addition to its sensor model.
  struct Knowledge {
    Eigen::VectorXd weights;  // weight of each axis's equation
    bool gives_field = true;
  };
  Reducer(const SensorModel& sensor, const Knowledge& knowledge, const ReductionOptions& options);

  void require_components(Eigen::Index readings) const;
  // f_hat of m >= 3 axes; false if the readings do not determine it.
  bool solve(std::span<const double> readings,
             const ReadingContext& context,
             Eigen::Vector3d& field) const noexcept;
  // The fields of a three-axis instrument, computed by the vector kernel reduce_columns().
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

  // T_s (v - b(t)) of one axis.
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
  std::vector<Eigen::Matrix3d> also_;  // apparent field per unit of the second field, 3 x 3
  std::optional<ReadingRange> range_;
  double factor_ = 1.0;
  double declination_rad_ = 0.0;
};

}  // namespace axiscal
