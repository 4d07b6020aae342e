// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command_line.hpp"

namespace axiscal::cli {

/// Each runs one subcommand and returns its exit status; errors are thrown.
int run(const CalibrateCommand& command);
int run(const ApplyCommand& command);
int run(const PlanCommand& command);
int run(const SimulateCommand& command);
int run(const LevelCommand& command);
int run(const CharacterizeCommand& command);
int run(const FieldCommand& command);
int run(const CheckCommand& command);
int run(const BudgetCommand& command);
int run(const StudyCommand& command);
int run(const SegmentCommand& command);
int run(const NoiseCommand& command);
int run(const ExportCommand& command);
int run(const ImportCommand& command);
int run(const ReportCommand& command);
int run(const AcquireCommand& command);
int run(const TemplateCommand& command);

/// `calibrate --imu`.
int run_imu(const CalibrateCommand& command);

}  // namespace axiscal::cli
