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
  /// Specific force from an accelerometer at rest [any unit], in the frame of field_in_sensor.
  std::optional<Eigen::Vector3d> up;
  double declination_rad = 0.0;  ///< added to magnetic headings
};

/// Results that a kind of instrument derives from the field: at most four numbers. In a table, NaN
/// is written as an empty cell.
struct DerivedValues {
  std::array<double, 4> values{};
  bool clamped = false;
};

/// The part of a calibration that is the input of InstrumentKind::describe.
struct CalibratedInstrument {
  const Instrument& instrument;
  const LinearResponse& response;
  Eigen::MatrixXd covariance;  ///< bias and sensitivity, 4 m x 4 m, axis by axis; or empty
  std::string field_kind;
  std::string field_unit;
  double magnitude = 1.0;                              ///< F [field unit]
  std::optional<Eigen::Vector3d> in_table;             ///< the field in the table [field unit]
  std::optional<Eigen::Matrix3d> in_table_covariance;  ///< covariance of in_table [field unit^2]
};

/// A named quantity in the usual terms of a kind of instrument, with one or more values.
struct KindQuantity {
  std::string name;            ///< "hard_iron", "responsivity", "dip_to_table_deg", ...
  std::string of;              ///< the axis or component to which it belongs; may be empty
  std::vector<double> values;  ///< one value, or one for each component
  std::vector<double> u;       ///< standard uncertainties (type A); NaN if they are unknown
  std::string unit;
};

/// The type of sensor in vehicles and phones that corresponds to an instrument.
enum class VehicleSensor { none, accelerometer, gyroscope, magnetometer };

/// Names of the columns in logs that contain an instrument's readings.
struct ColumnNames {
  std::string_view letters;  ///< first letters of names with one or two letters: "gw": "gx", "wx"
  std::string_view word;     ///< text that a longer name contains: "gyr" for "gyro_x"
};

/// The properties of a kind of instrument: its name and the results that its users expect.
///
/// To add a kind to Axiscal, add a file to src/kinds/. To add a kind to a program of your own, call
/// add_instrument_kind().
struct InstrumentKind {
  std::string_view name;
  std::span<const std::string_view> derived_names;  ///< columns, e.g. "pitch_deg"

  /// A function that returns one value for each of derived_names; null if derived_names is empty.
  /// It is called for each reading, from several threads, and must not throw.
  std::function<DerivedValues(const DeriveInput& input)> derive;

  bool derives_with_attitude = false;  ///< true: without DeriveInput::up, derive() is not called
  bool has_axis_elevation = false;     ///< true: an axis's angle above the horizontal is a result

  std::string_view usual_field;  ///< default kind of field; empty: it must be stated
  /// True: if neither a magnitude, a unit nor a site is stated, the magnitude of the usual field is
  /// 1.
  bool relative_field_will_do = false;
  VehicleSensor sensor = VehicleSensor::none;
  ColumnNames columns;              ///< empty: the kind has no usual column names
  bool sees_one_side = false;       ///< true if its axes may respond only to light from the front
  bool answers_to_gravity = false;  ///< true if it often responds to gravity too

  /// A function that returns further results for the record and the summary, besides bias and
  /// sensitivity; may be null.
  std::function<std::vector<KindQuantity>(const CalibratedInstrument& calibrated)> describe;
};

/// @return all known kinds: first those of this version, then those that were added.
[[nodiscard]] AXISCAL_EXPORT const std::deque<InstrumentKind>& instrument_kinds();

/// Adds a kind of instrument. Call it before calibrating, from one thread.
///
/// @return the added kind.
/// @throws DomainError  if the name is empty or exists already, or if derived_names has more than
///                      four entries or lacks derive().
AXISCAL_EXPORT const InstrumentKind& add_instrument_kind(const InstrumentKind& kind);

/// @return the kind of that name.
/// @throws DomainError  if there is no kind of that name; the message lists the names.
[[nodiscard]] AXISCAL_EXPORT const InstrumentKind& find_instrument_kind(std::string_view name);

}  // namespace axiscal
