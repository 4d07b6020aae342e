// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/instruments/inclination.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/instruments/settings.hpp"

/// @file
/// The response of an instrument to a field, v = b + S f, and the usual terms of its users.
///
/// An Instrument has a kind, axes and units; a LinearResponse its coefficients; an InstrumentKind
/// what is special to accelerometers, magnetometers, gyroscopes, light sensors: angles, hard iron,
/// headings.
///
/// @code
/// const axiscal::LinearResponse response{.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
///                                        .sensitivity = 2.5 * Eigen::Matrix3d::Identity()};
/// const Eigen::VectorXd volts = response.at(Eigen::Vector3d::UnitZ());
/// std::printf("%.2f V\n", volts(2));
/// @endcode
///
/// Traps:
/// - Row k of S is axis k; its columns are the field's components in the sensor's frame.
/// - The axes' names matter: "acc_x" says which component it should sense.
