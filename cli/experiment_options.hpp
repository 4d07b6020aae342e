// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// Options that describe an experiment, as typed.
struct ExperimentOptions {
  std::vector<std::string> files;
  std::optional<std::string> instrument, serial, model, axes, unit, convention, range;
  std::optional<std::string> field, also, field_unit, field_magnitude, field_magnitude_u,
      field_table;
  std::optional<std::string> magnetic_model, gravity_model, source;
  std::optional<std::string> latitude, longitude, height, date;
  std::optional<std::string> fence_azimuth, slope, positioner, slot, assembly, face_names;
  std::optional<std::string> method, shape, weights, leave_out, level_by, drift, seats, noise_ratio;
  std::optional<std::string> temperature_order, temperature_reference, from;
  std::optional<std::string> resolution, slope_u, direction_u, temperature_u, reference_u,
      positioner_u;
  std::optional<std::string> nominal_sensitivity;
  bool robust = false;
  bool squares = false;
  bool one_sided = false;
  bool polar_fit = false;
};

/// The observations' files, or the experiment's.
void add_files(OptionSet& options, ExperimentOptions& experiment, Need need);

void add_experiment_options(OptionSet& options, ExperimentOptions& experiment);

/// The experiment of a file (`.json`) or of the options alone; options win.
///
/// @param base  what counts where neither says anything.
/// @throws UsageError  for a value that is not one of its option's, or none where one is needed.
/// @throws DataError   for the experiment's or the positioner's file.
[[nodiscard]] Experiment make_experiment(const ExperimentOptions& options,
                                         const Experiment& base = {});

/// As above, with the files that it names.
[[nodiscard]] ExperimentFile make_experiment_file(const ExperimentOptions& options,
                                                  const Experiment& base = {});

/// Takes over the unit of the readings that a file states, where the options state none; gravity is
/// then in m/s^2 too, the standard one where neither site nor magnitude is stated.
/// @return the assumptions, in words; may be empty.
std::string take_unit_of_file(const std::string& unit, ExperimentOptions& options);

/// @return true if the options give an instrument for each of several slots, SLOT=KIND,..
[[nodiscard]] bool states_slots(const ExperimentOptions& options);

/// @return true if a file is an experiment: JSON with this format, or unreadable JSON.
[[nodiscard]] bool is_experiment_file(const std::string& path);

/// The experiment that made a record, reconstructed from the record; its positioner is the nominal
/// cube.
[[nodiscard]] Experiment experiment_of(const Calibration& record);

}  // namespace axiscal::cli
