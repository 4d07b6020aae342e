// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/instruments/inclination.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/instruments/settings.hpp"

/// @file
/// The response of an instrument to a field, v = b + S f, and the results that are usual for each
/// kind of instrument.
///
/// An Instrument describes the kind, axes and units. A LinearResponse contains the coefficients b
/// and S. An InstrumentKind computes the results that only accelerometers, magnetometers,
/// gyroscopes or light sensors have: angles, hard iron, headings.
///
/// @code
/// const axiscal::LinearResponse response{.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
///                                        .sensitivity = 2.5 * Eigen::Matrix3d::Identity()};
/// const Eigen::VectorXd volts = response.at(Eigen::Vector3d::UnitZ());
/// std::printf("%.2f V\n", volts(2));
/// @endcode
///
/// Traps:
/// - Row k of S belongs to axis k. The columns of S belong to the field's x, y, z in the sensor's
///   frame.
/// - The name of an axis decides which component it should sense: "acc_x" should sense x.
