// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/exchange/export.hpp"
#include "axiscal/exchange/import.hpp"

/// @file
/// Conversion of calibrations to and from the formats of other software. Export formats include C
/// headers, PX4, ArduPilot, Kalibr, ROS and DCC; some formats can be imported.
///
/// @code
/// for (const axiscal::ExportFormat& format : axiscal::export_formats()) {
///   std::printf("%s\n", std::string(format.formula).c_str());
/// }
/// @endcode
///
/// Traps:
/// - Many formats cannot store cross-axis terms or temperature terms. Export to them throws unless
/// `lossy` is true. With `lossy`, the export reports the loss in the unit of the field.
/// - An imported record has only coefficients, without uncertainties.
