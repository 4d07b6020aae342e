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
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/kernels/reduce_columns.hpp"

namespace axiscal {

struct ReductionOptions {
  /// F where readings are taken [unit of the results]; default: the record's.
  std::optional<double> magnitude;
  double factor = 1.0;  ///< unit of the results per unit of the record's field, see FieldConversion
  InclinationOptions inclination;  ///< the convention is the record's
  double declination_rad = 0.0;    ///< added to magnetic headings
};

/// What is known of the field where readings are taken.
struct FieldThere {
  std::optional<double> magnitude;     ///< F [unit of the results]; default: the record's, in `g` 1
  double magnitude_u = 0.0;            ///< its standard uncertainty [that unit]
  std::optional<double> gravity_m_s2;  ///< gravity there; default: the record's site
  double gravity_u_m_s2 = 0.0;         ///< its standard uncertainty
};

/// In what unit results are, and of which magnitude the field is where readings are taken.
struct FieldConversion {
  std::string unit;
  double factor = 1.0;     ///< results = factor * field in the record's unit
  double magnitude = 1.0;  ///< F where readings are taken [unit]
  /// Standard uncertainties by those of the fields here and there, relative: of components, and of
  /// a component over F, which angles and residuals hold. In the field of the calibration the
  /// latter is exact; so are components in `g` of the calibration's place.
  double component_u = 0.0;
  double ratio_u = 0.0;
};

/// Takes a record from the field of its site to that of another.
///
/// Units of one quantity convert (nT, uT, T; rad/s, deg/s, deg/h). A record in `g`, whose 1 g was
/// the gravity of its site, and one in m/s^2 convert to each other and to another site's `g` by the
/// two sites' gravity.
///
/// @param field      the record's.
/// @param unit       of the results; empty: the record's.
/// @param there      where readings are taken; as where the record was made, if nothing is stated.
/// @throws DomainError  if the units do not convert, or the record does not say what its g was.
[[nodiscard]] FieldConversion field_conversion(const FieldDescription& field,
                                               const std::string& unit,
                                               const FieldThere& there = {});

/// The same calibration in another unit of the field.
/// @param conversion  as field_conversion(); its magnitude becomes the record's.
[[nodiscard]] Calibration converted(Calibration calibration, const FieldConversion& conversion);

/// The same calibration in the frame of the assembly that it was calibrated in, so that several
/// instruments answer alike, a mirrored one of an H frame among them; as it is where the record
/// states none.
[[nodiscard]] Calibration in_assembly_frame(Calibration calibration);

/// What is known beside the readings of an instrument.
struct ReadingContext {
  /// Specific force at rest in the sensor's frame, from an accelerometer in its frame: for
  /// headings, and [unit of the second field] to take out what the instrument answers to it.
  std::optional<Eigen::Vector3d> up;
  /// Sensor output of a record with temperature terms; without it the calibration's reference
  /// counts.
  std::optional<SensorTemperature> temperature;
  std::optional<Eigen::Matrix3d> up_covariance;  ///< for uncertainties [unit of up, squared]
};

/// What a reading of three or more axes says.
struct ReducedReading {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< f_hat [field unit]
  double residual = 0.0;      ///< |f_hat| - F [field unit]; NaN where the biases hold the field
  DerivedValues derived;      ///< as the kind of instrument says; likewise
  bool determined = true;     ///< false: fewer than three one-sided axes see the light
  bool extrapolated = false;  ///< the temperature is outside the calibrated range
  std::span<const std::string_view> derived_names;  ///< of the values in `derived`

  /// @param name  "x", "y", "z" of the field, "residual", or of what the kind of instrument
  ///              derives, as "pitch_deg".
  /// @return that number.
  /// @throws DomainError  for another name; the message lists them.
  [[nodiscard]] double operator[](std::string_view name) const;
};

/// What a reading of one axis says where there are fewer than three.
struct ReducedAxis {
  double component = 0.0;  ///< field along the sensing axis [field unit]
  /// How far the axis points above the horizontal; 0 where the kind has none, NaN where the bias
  /// holds the field.
  double angle_rad = 0.0;
  bool clamped = false;
  bool extrapolated = false;
};

/// The way back: raw readings to field components, residual and derived quantities.
///
///     f_hat = S^-1 T_s (v - b(t)), T_s = diag(1 / scale_k(t)), without temperature terms 1;
///     m > 3: least squares weighted by scale_k^2 / s_k^2
///
/// Of a record whose biases hold the field (gives_field()) f_hat is only how far a reading is from
/// bias(t): it has no residual and no direction.
///
/// Of one-sided axes those count that see the light, by the reduced field itself, until it stays.
///
/// After construction nothing is allocated: fit for use in real time.
///
/// @code
/// const axiscal::Reducer reduce(axiscal::read_calibration("cal.json"));
/// const double pitch_deg = reduce(std::array{0.01, -0.02, 0.99})["pitch_deg"];
/// @endcode
///
/// @par Source
/// method.md, section 7; US 7,467,536.
class Reducer {
 public:
  /// @throws DomainError  if m >= 3 axes do not determine the field (S of rank below 3), an axis
  ///                      has no sensitivity, or the magnitude is not positive.
  explicit Reducer(const SensorModel& sensor, const ReductionOptions& options = {});

  /// As by its sensor; of more than three axes each counts as it scatters, and biases that hold the
  /// field (gives_field()) are known as such.
  /// @throws RefusedError  if the calibration was refused and `force` is `no`.
  explicit Reducer(const Calibration& calibration,
                   const ReductionOptions& options = {},
                   Force force = Force::no);

  /// @return m, the number of readings that reduce() takes.
  [[nodiscard]] std::size_t axis_count() const { return bias_.size(); }

  /// @return whether reduce() may be called: three or more axes.
  [[nodiscard]] bool gives_components() const { return bias_.size() >= 3; }

  [[nodiscard]] const InstrumentKind& kind() const { return *kind_; }

  /// @return F, the field's magnitude that residuals and angles refer to [field unit].
  [[nodiscard]] double magnitude() const { return magnitude_; }

  /// @param readings  axis_count() finite readings [unit], in the order of the axes; m >= 3.
  /// @param context   what is known beside them.
  /// @throws DomainError  if these are not axis_count() readings, or fewer than three. It allocates
  ///                      nothing otherwise.
  [[nodiscard]] ReducedReading reduce(std::span<const double> readings,
                                      const ReadingContext& context = {}) const;

  /// The same in short: `reduce(volts)["pitch_deg"]`.
  [[nodiscard]] ReducedReading operator()(std::span<const double> readings,
                                          const ReadingContext& context = {}) const {
    return reduce(readings, context);
  }

  /// @return whether the record has temperature terms, so that reduce() needs a temperature.
  [[nodiscard]] bool needs_temperature() const { return temperature_.has_value(); }

  /// @return whether it needs one for each axis.
  [[nodiscard]] bool has_own_temperatures() const {
    return temperature_ && temperature_->has_own_sensors();
  }

  /// @return whether a reading is at or beyond the range of its axis.
  [[nodiscard]] bool is_saturated(double reading) const noexcept {
    return range_ && (reading <= range_->low || reading >= range_->high);
  }

  /// @return whether columns() may be called: three plain axes.
  [[nodiscard]] bool has_columns() const;

  /// @return whether pitch and roll as reduce_columns() makes them are those that reduce() derives:
  /// an instrument of inclination in forward-left-up axes, its pitch by the arcsine.
  [[nodiscard]] bool has_angle_columns() const;

  /// What a reading says whose field was reduced with many others, by columns().
  /// @param made  its angles, where they are made too (has_angle_columns()); null: they are made
  /// here.
  [[nodiscard]] ReducedReading of_field(const Eigen::Vector3d& field_in_sensor,
                                        const PitchAndRoll* made = nullptr) const;

  /// The reduction of three plain axes as reduce_columns() and reduce_rows() take it: whole arrays
  /// at once, at the speed of memory. Components in the results' unit; pitch and roll in
  /// forward-left-up axes.
  /// @throws DomainError  for other than three axes, one-sided ones, temperature terms or second
  ///                      fields: those need reduce(), reading by reading.
  [[nodiscard]] ColumnReduction columns() const;

  /// The field along one sensing axis: (v - b) / |S_k|; any m.
  ///
  /// @param axis     0 .. m - 1.
  /// @param reading  [unit], finite.
  /// @param temperature  as reduce().
  [[nodiscard]] ReducedAxis reduce_axis(
      std::size_t axis,
      double reading,
      const std::optional<SensorTemperature>& temperature = {}) const noexcept;

  /// @return |S_k|, what an axis reads more in one unit of the results' field along it.
  [[nodiscard]] double sensitivity_of(std::size_t axis) const { return length_[axis]; }

  /// @return whether two axes give the whole field: what they leave open follows from its
  /// magnitude, and it is in front of them, as the sun is of a sun sensor.
  [[nodiscard]] bool closes_by_magnitude() const { return open_direction_.has_value(); }

  /// The field by two axes and its magnitude.
  struct ClosedField {
    Eigen::Vector3d in_sensor = Eigen::Vector3d::Zero();  ///< f_hat [field unit]
    bool clamped = false;  ///< the axes see more than F, so that nothing is left open
  };

  /// What two axes see, and square to both, on the side of first x second,
  /// sqrt(F^2 - |what they see|^2).
  ///
  /// @param first, second  readings of the two axes [unit], finite.
  /// @param temperature    as reduce().
  /// @throws DomainError  unless closes_by_magnitude().
  [[nodiscard]] ClosedField closed_field(
      double first, double second, const std::optional<SensorTemperature>& temperature = {}) const;

 private:
  // What is known of a sensor besides what it is.
  struct Knowledge {
    Eigen::VectorXd weights;  // of the axes' equations
    bool gives_field = true;
  };
  Reducer(const SensorModel& sensor, const Knowledge& knowledge, const ReductionOptions& options);

  // What follows from the field that a reading was reduced to.
  void describe(const ReadingContext& context,
                const PitchAndRoll* made,
                ReducedReading& result) const;

  const InstrumentKind* kind_;
  double magnitude_;
  InclinationOptions inclination_;
  std::vector<double> bias_;
  std::vector<double> length_;            // |S_k|
  std::vector<Eigen::Vector3d> inverse_;  // columns of the pseudo-inverse of S
  [[nodiscard]] bool solve_lit(std::span<const double> readings,
                               const std::optional<SensorTemperature>& temperature,
                               Eigen::Vector3d& field) const noexcept;

  // T_s (v - b(t)) of one axis.
  [[nodiscard]] double above_bias(
      std::size_t axis,
      double reading,
      const std::optional<SensorTemperature>& temperature) const noexcept;
  [[nodiscard]] bool solve_scaled(std::span<const double> readings,
                                  const std::optional<SensorTemperature>& temperature,
                                  Eigen::Vector3d& field) const noexcept;

  bool gives_field_ = true;
  bool one_sided_ = false;
  std::optional<Eigen::Vector3d> open_direction_;  // of two axes that close by magnitude
  std::vector<Eigen::Vector3d> rows_;  // rows of S, where the inverse is not one for all readings
  std::vector<double> weights_;        // those axes' weights
  std::optional<TemperatureResponse> temperature_;
  std::vector<Eigen::Matrix3d> also_;  // field per second field, to be taken out
  std::optional<ReadingRange> range_;
  double factor_ = 1.0;
  double declination_rad_ = 0.0;
};

}  // namespace axiscal
