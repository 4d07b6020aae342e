// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "command_line.hpp"

namespace axiscal::cli {

/// The experiment of a file (`.json`) or of the options alone; options win.
///
/// @param base  what counts where neither says anything.
/// @throws UsageError  for a value that is not one of its option's, or none where one is needed.
/// @throws DataError   for the experiment's or the positioner's file.
[[nodiscard]] Experiment make_experiment(const ExperimentOptions& options, Experiment base = {});

/// The experiment that made a record, as far as the record says it; its positioner is the nominal
/// cube.
[[nodiscard]] Experiment experiment_of(const Calibration& record);

}  // namespace axiscal::cli
