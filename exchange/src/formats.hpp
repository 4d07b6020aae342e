// SPDX-License-Identifier: Apache-2.0
// The function that writes each export format. The table of formats is in export.cpp.
#pragma once

#include "axiscal/exchange/export.hpp"

namespace axiscal {

Exported export_c_header(const Calibration& calibration, const ExportOptions& options);
Exported export_cpp_header(const Calibration& calibration, const ExportOptions& options);
Exported export_csv(const Calibration& calibration, const ExportOptions& options);
Exported export_matlab(const Calibration& calibration, const ExportOptions& options);
Exported export_numpy(const Calibration& calibration, const ExportOptions& options);
Exported export_kalibr(const Calibration& calibration, const ExportOptions& options);
Exported export_kalibr_imu(const Calibration& first,
                           const Calibration& second,
                           const ExportOptions& options);
Exported export_ros(const Calibration& calibration, const ExportOptions& options);
Exported export_x_io(const Calibration& calibration, const ExportOptions& options);
Exported export_px4(const Calibration& calibration, const ExportOptions& options);
Exported export_ardupilot(const Calibration& calibration, const ExportOptions& options);
Exported export_iio(const Calibration& calibration, const ExportOptions& options);
Exported export_xlsx(const Calibration& calibration, const ExportOptions& options);
Exported export_dcc(const Calibration& calibration, const ExportOptions& options);
Exported export_openhtf(const Calibration& calibration, const ExportOptions& options);
Exported export_tofupilot(const Calibration& calibration, const ExportOptions& options);
Exported export_label(const Calibration& calibration, const ExportOptions& options);
Exported export_betaflight(const Calibration& calibration, const ExportOptions& options);

/// @return the name of a flight controller's parameter for axis k (0, 1, 2). The name consists of
///         the prefix, the letter X, Y or Z, and the suffix.
std::string axis_parameter(const std::string& prefix, int k, const std::string& suffix);

/// @param instance  zero-based number of the sensor.
/// @param sensor    "ACC" or "GYR".
/// @return the prefix of the sensor's parameters in ArduPilot: "INS_ACC", "INS_ACC2", "INS_ACC3",
///         "INS4_ACC", ...
std::string ardupilot_group(int instance, std::string_view sensor);

}  // namespace axiscal
