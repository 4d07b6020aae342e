// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The directions of the sensor's axes in the vehicle. They affect only the computed angles.
enum class AxisConvention {
  forward_left_up,     ///< the default
  forward_right_down,  ///< y and z change sign in the angle formulas
};

/// @return the convention called "flu" or "frd".
/// @throws DomainError  for another name.
[[nodiscard]] AXISCAL_EXPORT AxisConvention parse_convention(std::string_view name);

/// Matrix of sensitivities: one row for each sensing axis, columns for the field's x, y and z.
using SensitivityMatrix = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// The range of the readings of an axis. A reading at or beyond a limit is saturated.
struct ReadingRange {
  double low = 0.0;   ///< lower limit [unit of the readings]
  double high = 0.0;  ///< upper limit [unit of the readings], greater than `low`
};

/// An axis that is the difference of two columns, e.g. of two opposite photodiodes.
struct DifferentialAxis {
  std::string axis;   ///< name of the axis
  std::string plus;   ///< the column that is added
  std::string minus;  ///< the column that is subtracted
};

/// Names, axes and units of an instrument.
struct AXISCAL_EXPORT Instrument {
  std::string kind;                                 ///< name of an InstrumentKind
  std::string serial;                               ///< serial number (see check_serial()) or empty
  std::string model;                                ///< name of the instrument's model or type
  std::vector<std::string> axes = {"x", "y", "z"};  ///< names of the sensing axes, one or more
  std::string unit = "1";                           ///< unit of the readings, any text
  AxisConvention convention = AxisConvention::forward_left_up;
  std::vector<DifferentialAxis> differences;  ///< the axes that are differences of two columns
  std::optional<ReadingRange> range;          ///< limits; a reading at or beyond them is saturated
  bool one_sided = false;  ///< true if an axis responds only to light from its front (photodiodes)

  [[nodiscard]] Eigen::Index axis_count() const { return static_cast<Eigen::Index>(axes.size()); }
};

/// Each function of this group returns an instrument with the axes x, y, z. The function name
/// states the kind of instrument.
/// @param unit  unit of the readings, any text.
[[nodiscard]] AXISCAL_EXPORT Instrument accelerometer(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument inclinometer(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument magnetometer(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument gyroscope(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument optical(const std::string& unit);

/// Sets the axes from texts as users write them: "x", or "d=p-n" for the difference of two columns.
/// @param instrument  receives the axes and differences.
/// @throws DomainError  if a text has another form, or check_axes() rejects the result.
AXISCAL_EXPORT void set_axes(Instrument& instrument, const std::vector<std::string>& texts);

/// @throws DomainError  if there is no axis, or a name is empty or repeated.
AXISCAL_EXPORT void check_axes(const Instrument& instrument);

/// Checks a serial number, because it is used in file names and in printed lines.
/// @throws DomainError  if it is longer than 200 bytes, contains a control character or is not
///                      UTF-8.
AXISCAL_EXPORT void check_serial(std::string_view serial);

/// Returns the component of the field that an axis is meant to sense.
///
/// @param instrument  only the names and the number of its axes are used.
/// @param axis        index of the axis, 0 .. axis_count() - 1.
/// @return 0, 1, 2 for x, y, z. The last letter of the axis's name decides ("x", "acc_x", "aX"). If
///         it is another letter and the instrument has three axes, their order decides. Otherwise
///         the result is nullopt.
[[nodiscard]] AXISCAL_EXPORT std::optional<int> nominal_axis(const Instrument& instrument,
                                                             Eigen::Index axis);

/// The linear response v = b + S f of an instrument with m axes.
struct LinearResponse {
  Eigen::VectorXd bias;           ///< b, m entries [unit]
  SensitivityMatrix sensitivity;  ///< S, m x 3 [unit per field unit], columns in frame sensor

  /// @param field_in_sensor  f [field unit].
  /// @return v, m entries [unit].
  [[nodiscard]] Eigen::VectorXd at(const Eigen::Vector3d& field_in_sensor) const {
    return bias + sensitivity * field_in_sensor;
  }
};

/// @return the result of nominal_axis(). If that is nullopt, the component to which the axis is
///         most sensitive.
[[nodiscard]] AXISCAL_EXPORT int main_axis(const Instrument& instrument,
                                           const LinearResponse& response,
                                           Eigen::Index axis);

}  // namespace axiscal
