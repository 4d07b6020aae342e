// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/exchange/export.hpp"
#include "axiscal/exchange/import.hpp"

/// @file
/// Calibrations in the forms of other software: C headers, PX4, ArduPilot, Kalibr, ROS, DCC, and
/// back.
///
/// @code
/// for (const axiscal::ExportFormat& format : axiscal::export_formats()) {
///   std::printf("%s\n", std::string(format.formula).c_str());
/// }
/// @endcode
///
/// Traps:
/// - Many formats cannot hold cross-axis terms or temperature. Export refuses unless `lossy` is
///   set, and then states the loss in the field's unit.
/// - An imported record has coefficients only, without uncertainty.
