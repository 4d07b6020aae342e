// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/report/calibration_report.hpp"
#include "axiscal/report/certificate.hpp"
#include "axiscal/report/noise_report.hpp"
#include "axiscal/report/run_sheet_page.hpp"

/// @file
/// Output for people: reports of a calibration or of a log's noise as one HTML page, certificates
/// as PDF, and run sheets to print.
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
/// - A certificate contains only the details that the caller states. missing_details() lists the
/// missing details that ISO/IEC 17025 requires.
