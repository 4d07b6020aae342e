// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "subcommand.hpp"

namespace axiscal::cli {

Subcommand acquire_subcommand();
Subcommand apply_subcommand();
Subcommand budget_subcommand();
Subcommand calibrate_subcommand();
Subcommand characterize_subcommand();
Subcommand check_subcommand();
Subcommand export_subcommand();
Subcommand field_subcommand();
Subcommand import_subcommand();
Subcommand level_subcommand();
Subcommand log_subcommand();
Subcommand noise_subcommand();
Subcommand plan_subcommand();
Subcommand report_subcommand();
Subcommand segment_subcommand();
Subcommand simulate_subcommand();
Subcommand study_subcommand();
Subcommand template_subcommand();

}  // namespace axiscal::cli
