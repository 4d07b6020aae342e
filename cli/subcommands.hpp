// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "subcommand.hpp"

namespace axiscal::cli {

struct AcquireCommand;
struct ExportCommand;
struct ImportCommand;
struct ReportCommand;
struct StoreCommand;

Subcommand apply_subcommand();
Subcommand budget_subcommand();
Subcommand calibrate_subcommand();
Subcommand characterize_subcommand();
Subcommand check_subcommand();
Subcommand field_subcommand();
Subcommand level_subcommand();
Subcommand log_subcommand();
Subcommand merge_subcommand();
Subcommand noise_subcommand();
Subcommand plan_subcommand();
Subcommand segment_subcommand();
Subcommand simulate_subcommand();
Subcommand study_subcommand();
Subcommand template_subcommand();

/// Subcommands that other programs run (see core/own_program.hpp). Their options are defined here,
/// so that `axiscal` can print the help and check the command line.
/// @param run  function that runs the subcommand; null in `axiscal`, which starts the other
///             program.
Subcommand acquire_subcommand(int (*run)(const AcquireCommand& command));
Subcommand export_subcommand(int (*run)(const ExportCommand& command));
Subcommand import_subcommand(int (*run)(const ImportCommand& command));
Subcommand report_subcommand(int (*run)(const ReportCommand& command));
Subcommand store_subcommand(int (*run)(const StoreCommand& command));

}  // namespace axiscal::cli
