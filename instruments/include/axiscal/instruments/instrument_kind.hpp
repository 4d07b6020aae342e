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

/// The input of InstrumentKind::derive: the field that was computed from a reading.
struct DeriveInput {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< the field [field unit], finite
  double magnitude = 1.0;                                     ///< reference F [field unit], > 0
  InclinationOptions inclination;
  /// Specific force measured by an accelerometer at rest [any unit], in the frame of
  /// field_in_sensor; nullopt without an accelerometer.
  std::optional<Eigen::Vector3d> up;
  double declination_rad = 0.0;  ///< declination, which is added to magnetic headings
};

/// Results that a kind of instrument computes from the field: at most four numbers. NaN is written
/// to tables as an empty cell.
struct DerivedValues {
  std::array<double, 4> values{};
  bool clamped = false;
};

/// The part of a calibration that is the input of InstrumentKind::describe.
struct CalibratedInstrument {
  const Instrument& instrument;
  const LinearResponse& response;
  /// Covariance of bias and sensitivities, axis by axis, 4m x 4m; empty if it is unknown.
  Eigen::MatrixXd covariance;
  std::string field_kind;
  std::string field_unit;
  double magnitude = 1.0;                              ///< the field's magnitude F [field unit]
  std::optional<Eigen::Vector3d> in_table;             ///< the field in the table [field unit]
  std::optional<Eigen::Matrix3d> in_table_covariance;  ///< covariance of in_table [field unit^2]
};

/// A quantity that users of a kind of instrument expect, with one or more values.
struct KindQuantity {
  std::string name;            ///< name of the quantity, e.g. "hard_iron" or "responsivity"
  std::string of;              ///< the axis or component to which it belongs; may be empty
  std::vector<double> values;  ///< one value, or one for each component
  std::vector<double> u;       ///< standard uncertainties (type A); NaN if they are unknown
  std::string unit;
};

/// The type of sensor in vehicles and phones that corresponds to an instrument.
enum class VehicleSensor { none, accelerometer, gyroscope, magnetometer };

/// Patterns of column names by which the readings of an instrument are found in a log.
struct ColumnNames {
  std::string_view letters;  ///< possible first letters of short names; "gw" finds "gx" and "wx"
  std::string_view word;     ///< text that longer names contain; "gyr" finds "gyro_x"
};

/// The properties of a kind of instrument: its name and the results that its users expect.
///
/// To add a kind to Axiscal, add a file to src/kinds/. To add a kind to a program of your own, call
/// add_instrument_kind().
struct InstrumentKind {
  std::string_view name;
  std::span<const std::string_view> derived_names;  ///< names of derived results, e.g. "pitch_deg"

  /// A function that returns one value for each of derived_names; null if derived_names is empty.
  /// It is called for each reading, from several threads, and must not throw.
  std::function<DerivedValues(const DeriveInput& input)> derive;

  bool derives_with_attitude = false;  ///< true if derive() needs DeriveInput::up
  bool has_axis_elevation = false;     ///< true if results include each axis's elevation angle

  std::string_view usual_field;  ///< default kind of field; if empty, the user must state the kind
  /// True if the default is a field of magnitude 1, in relative units, when no magnitude, unit or
  /// site is stated.
  bool relative_field_will_do = false;
  VehicleSensor sensor = VehicleSensor::none;
  ColumnNames columns;              ///< usual column names in logs; empty if there are none
  bool sees_one_side = false;       ///< true if an axis may respond only to light from its front
  bool answers_to_gravity = false;  ///< true if such instruments often respond to gravity too

  /// A function that returns further results for the record and the summary, besides bias and
  /// sensitivity; may be null.
  std::function<std::vector<KindQuantity>(const CalibratedInstrument& calibrated)> describe;
};

/// @return all known kinds: first the built-in kinds, then those that were added.
[[nodiscard]] AXISCAL_EXPORT const std::deque<InstrumentKind>& instrument_kinds();

/// Adds a kind of instrument. Call it before calibrating, from one thread.
///
/// @return the added kind.
/// @throws DomainError  if the name is empty or exists already, derived_names has more than four
///                      entries, or derived_names is not empty but derive is null.
AXISCAL_EXPORT const InstrumentKind& add_instrument_kind(const InstrumentKind& kind);

/// @return the kind of that name.
/// @throws DomainError  if there is no kind of that name; the message lists the names.
[[nodiscard]] AXISCAL_EXPORT const InstrumentKind& find_instrument_kind(std::string_view name);

}  // namespace axiscal
