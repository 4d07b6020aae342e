// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

[[nodiscard]] InstrumentKind accelerometer_kind();
[[nodiscard]] InstrumentKind inclinometer_kind();
[[nodiscard]] InstrumentKind magnetometer_kind();
[[nodiscard]] InstrumentKind gyroscope_kind();
[[nodiscard]] InstrumentKind optical_kind();

/// Propagates the covariance of bias and sensitivity to a quantity that is derived from them.
///
/// @param of  a function that computes the quantity from a response. It must always return the same
///            number of values. Its derivatives are computed by central differences.
/// @return standard uncertainties, one for each value; NaN if the covariance is unknown.
[[nodiscard]] std::vector<double> propagated(
    const CalibratedInstrument& calibrated,
    const std::function<Eigen::VectorXd(const LinearResponse&)>& of);

/// Computes a quantity from the response, and its uncertainty.
[[nodiscard]] KindQuantity quantity_of(
    const CalibratedInstrument& calibrated,
    std::string name,
    std::string of_what,
    std::string unit,
    const std::function<Eigen::VectorXd(const LinearResponse&)>& of);

/// Propagates the covariance of the field in the table to a number that is computed from the field.
/// @return the standard uncertainty; NaN if the covariance is unknown.
[[nodiscard]] double propagate_field_uncertainty(
    const CalibratedInstrument& calibrated,
    const std::function<double(const Eigen::Vector3d& in_table)>& of);

/// Computes an angle from the field in the table, and its uncertainty. The field must be known.
[[nodiscard]] KindQuantity angle_of_field(
    const CalibratedInstrument& calibrated,
    std::string name,
    const std::function<double(const Eigen::Vector3d& in_table)>& angle_rad);

/// Computes the azimuth of the table's fence [rad], in (-pi, pi], from the horizontal part of a
/// field. The azimuth is relative to magnetic north if the field is geomagnetic, and relative to
/// true north if it is the Earth's rotation.
[[nodiscard]] double fence_azimuth_from(const Eigen::Vector3d& in_table);

}  // namespace axiscal
