// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// A reduced reading, the input of derived results.
struct DeriveInput {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< [field unit], finite
  double magnitude = 1.0;                                     ///< F [field unit], positive
  InclinationOptions inclination;
  /// Specific force at rest in the same frame [any unit], from an accelerometer.
  std::optional<Eigen::Vector3d> up;
  double declination_rad = 0.0;  ///< added to magnetic headings
};

/// Results that a kind of instrument derives from the field: at most four numbers. NaN leaves a
/// cell empty.
struct DerivedValues {
  std::array<double, 4> values{};
  bool clamped = false;
};

/// A calibration as a kind of instrument looks at it.
struct CalibratedInstrument {
  const Instrument& instrument;
  const LinearResponse& response;
  Eigen::MatrixXd covariance;  ///< covers bias and sensitivity, 4 m x 4 m, axis by axis; or empty
  std::string field_kind;
  std::string field_unit;
  double magnitude = 1.0;                              ///< F [field unit]
  std::optional<Eigen::Vector3d> in_table;             ///< the field in the table [field unit]
  std::optional<Eigen::Matrix3d> in_table_covariance;  ///< [field unit^2]
};

/// Parameters of a calibration in the usual terms of a kind of instrument: some numbers under a
/// name.
struct KindQuantity {
  std::string name;            ///< "hard_iron", "responsivity", "dip_to_table_deg", ...
  std::string of;              ///< the axis or component that it is of; may be empty
  std::vector<double> values;  ///< one, or one for each component
  std::vector<double> u;       ///< standard uncertainties (type A); NaN where they are not known
  std::string unit;
};

/// Which of the sensors of vehicles, phones and their software an instrument is.
enum class VehicleSensor { none, accelerometer, gyroscope, magnetometer };

/// How columns of logs are called that hold an instrument's readings.
struct ColumnNames {
  std::string_view letters;  ///< how a name of one or two letters begins: "gw" of "gx", "wx"
  std::string_view word;     ///< what a longer name has in it: "gyr" of "gyro_x"
};

/// A kind of instrument is data: its name and the results that its users expect.
///
/// A new kind is one such entry: for Axiscal itself one more file among src/kinds/, in a program of
/// your own one call of add_instrument_kind().
struct InstrumentKind {
  std::string_view name;
  std::span<const std::string_view> derived_names;  ///< columns, e.g. "pitch_deg"

  /// Returns one value for each of derived_names; null if derived_names is empty. It is called for
  /// each reading, from several threads, and must not throw.
  std::function<DerivedValues(const DeriveInput& input)> derive;

  bool derives_with_attitude = false;  ///< derive() needs DeriveInput::up, and is left out without
  bool has_axis_elevation = false;     ///< with fewer than three axes: angle above the horizontal

  std::string_view usual_field;  ///< kind of field where none is stated; empty: one must be
  /// If neither a magnitude, a unit nor a site tells the usual field's size, its length is 1.
  bool relative_field_will_do = false;
  VehicleSensor sensor = VehicleSensor::none;
  ColumnNames columns;              ///< empty: names do not tell the kind
  bool sees_one_side = false;       ///< its axes may respond only to light from the front
  bool answers_to_gravity = false;  ///< common in addition to its own field

  /// Results of the record and the summary in addition to bias and sensitivity; may be empty.
  std::function<std::vector<KindQuantity>(const CalibratedInstrument& calibrated)> describe;
};

/// @return all kinds that are known: those of this version, then those that were added.
[[nodiscard]] AXISCAL_EXPORT const std::deque<InstrumentKind>& instrument_kinds();

/// Adds a kind of instrument. Call it before calibrating, from one thread.
///
/// @return the kind as it is known from now on.
/// @throws DomainError  if the name is empty or there already, or derived_names are more than four
///                      or without derive().
AXISCAL_EXPORT const InstrumentKind& add_instrument_kind(const InstrumentKind& kind);

/// @return the kind of that name.
/// @throws DomainError  if there is none; the message lists the names.
[[nodiscard]] AXISCAL_EXPORT const InstrumentKind& find_instrument_kind(std::string_view name);

}  // namespace axiscal
