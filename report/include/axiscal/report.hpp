// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/report/calibration_report.hpp"
#include "axiscal/report/certificate.hpp"
#include "axiscal/report/noise_report.hpp"
#include "axiscal/report/run_sheet_page.hpp"

/// @file
/// What people look at: a calibration, or a log's noise, as one HTML page, a certificate as PDF, a
/// run sheet to print.
///
/// @code
/// axiscal::Calibration calibration;
/// calibration.sensor.instrument.kind = "accelerometer";
/// calibration.sensor.response = {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
/// const std::string page = axiscal::calibration_report(calibration);
/// std::printf("%zu bytes of HTML\n", page.size());
/// @endcode
///
/// Traps:
/// - A certificate states what its details say; missing_details() lists what ISO/IEC 17025 asks
///   for.
