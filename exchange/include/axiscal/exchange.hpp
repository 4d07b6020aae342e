// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/exchange/export.hpp"
#include "axiscal/exchange/import.hpp"

/// @file
/// Calibrations in the formats of other software: export to C headers, PX4, ArduPilot, Kalibr, ROS,
/// DCC and others, and import from some of them.
///
/// @code
/// for (const axiscal::ExportFormat& format : axiscal::export_formats()) {
///   std::printf("%s\n", std::string(format.formula).c_str());
/// }
/// @endcode
///
/// Traps:
/// - Many formats cannot store cross-axis terms or temperature terms. An export then throws unless
///   `lossy` is true; with `lossy` it reports the loss in the field's unit.
/// - An imported record has only coefficients, without uncertainties.
