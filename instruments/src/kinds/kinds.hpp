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

/// Standard uncertainties of quantities derived from bias and sensitivity, from their covariance.
///
/// @param of  the quantity, by central differences; as many numbers each time.
/// @return NaN each where the covariance is not known.
[[nodiscard]] std::vector<double> propagated(
    const CalibratedInstrument& calibrated,
    const std::function<Eigen::VectorXd(const LinearResponse&)>& of);

/// A quantity of the response with its uncertainty.
[[nodiscard]] KindQuantity quantity_of(
    const CalibratedInstrument& calibrated,
    std::string name,
    std::string of_what,
    std::string unit,
    const std::function<Eigen::VectorXd(const LinearResponse&)>& of);

/// Standard uncertainty of a number that follows from the field in the table; NaN if not known.
[[nodiscard]] double propagate_field_uncertainty(
    const CalibratedInstrument& calibrated,
    const std::function<double(const Eigen::Vector3d& in_table)>& of);

/// An angle that follows from the field in the table, which must be known, with its uncertainty.
[[nodiscard]] KindQuantity angle_of_field(
    const CalibratedInstrument& calibrated,
    std::string name,
    const std::function<double(const Eigen::Vector3d& in_table)>& angle_rad);

/// Azimuth of the table's fence from the direction that a field's horizontal part points to: the
/// magnetic or true north [rad], in (-pi, pi].
[[nodiscard]] double fence_azimuth_from(const Eigen::Vector3d& in_table);

}  // namespace axiscal
