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

/// The orientation of the sensor's axes in the vehicle. It affects angles only.
enum class AxisConvention {
  forward_left_up,     ///< the default
  forward_right_down,  ///< y and z change sign in the angle formulas
};

/// @return the convention called "flu" or "frd".
/// @throws DomainError  for another name.
[[nodiscard]] AXISCAL_EXPORT AxisConvention parse_convention(std::string_view name);

/// One row of numbers for each sensing axis: its sensitivity to the field's x, y, z.
using SensitivityMatrix = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// The range of an axis. A reading at either end or beyond is saturated.
struct ReadingRange {
  double low = 0.0;   ///< [unit of the readings]
  double high = 0.0;  ///< greater than low
};

/// An axis that is the difference of two columns, as of two opposite photodiodes.
struct DifferentialAxis {
  std::string axis;   ///< name of the axis
  std::string plus;   ///< the column that counts positive
  std::string minus;  ///< the column that is subtracted
};

/// Names, axes and units of an instrument.
struct AXISCAL_EXPORT Instrument {
  std::string kind;                                 ///< name of an InstrumentKind
  std::string serial;                               ///< as check_serial(); may be empty
  std::string model;                                ///< name of the design that several units share
  std::vector<std::string> axes = {"x", "y", "z"};  ///< names of the response columns, one or more
  std::string unit = "1";                           ///< unit of the readings, any text
  AxisConvention convention = AxisConvention::forward_left_up;
  std::vector<DifferentialAxis> differences;  ///< the axes that are not columns of their own
  std::optional<ReadingRange> range;  ///< readings of a column at or beyond it are saturated
  bool one_sided = false;  ///< the axes see only what comes from in front of them (photodiodes)

  [[nodiscard]] Eigen::Index axis_count() const { return static_cast<Eigen::Index>(axes.size()); }
};

/// @return an instrument of a kind with three axes x, y, z.
/// @param unit  of its readings, any text.
[[nodiscard]] AXISCAL_EXPORT Instrument accelerometer(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument inclinometer(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument magnetometer(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument gyroscope(const std::string& unit);
[[nodiscard]] AXISCAL_EXPORT Instrument optical(const std::string& unit);

/// Takes axes as users write them: "x", or "d=p-n" for the difference of two columns.
/// @param instrument  its axes and differences are set.
/// @throws DomainError  for a text that is neither, or names as check_axes().
AXISCAL_EXPORT void set_axes(Instrument& instrument, const std::vector<std::string>& texts);

/// @throws DomainError  unless there is an axis and each has a name of its own.
AXISCAL_EXPORT void check_axes(const Instrument& instrument);

/// @throws DomainError  if a serial number is longer than 200 bytes, holds a control character or
///                      is not UTF-8: it becomes part of files' names and of lines on a screen.
AXISCAL_EXPORT void check_serial(std::string_view serial);

/// The component of the field that an axis is meant to sense.
///
/// @param instrument  its axes' names and number are looked at.
/// @param axis        0 .. axis_count() - 1.
/// @return 0, 1, 2 for x, y, z: by the last letter of the axis's name ("x", "acc_x", "aX"), else by
///         its position if the instrument has three axes; nullopt otherwise.
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

/// @return nominal_axis(), or where nothing tells the component that the axis reads most.
[[nodiscard]] AXISCAL_EXPORT int main_axis(const Instrument& instrument,
                                           const LinearResponse& response,
                                           Eigen::Index axis);

}  // namespace axiscal
