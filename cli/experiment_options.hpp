// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "command_line.hpp"

namespace axiscal::cli {

/// The experiment of a file (`.json`) or of the options alone; options win.
///
/// @throws UsageError  for a value that is not one of its option's, or none where one is needed.
/// @throws DataError   for the experiment's or the positioner's file.
[[nodiscard]] Experiment make_experiment(const ExperimentOptions& options);

}  // namespace axiscal::cli
