// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "option_set.hpp"

namespace axiscal::cli {

/// The options that describe an experiment, with unparsed values.
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

/// Adds the argument for the files: files of observations, or the file of an experiment.
void add_files(OptionSet& options, ExperimentOptions& experiment, Need need);

void add_experiment_options(OptionSet& options, ExperimentOptions& experiment);

/// Makes an experiment from the options and, if one is given, from its file (`.json`). An option
/// takes precedence over the file.
///
/// @param base  experiment with the settings that neither the file nor the options state.
/// @throws UsageError  if the value of an option is invalid or missing.
/// @throws DataError   if the file of the experiment or of the positioner is invalid.
[[nodiscard]] Experiment make_experiment(const ExperimentOptions& options,
                                         const Experiment& base = {});

/// Makes an experiment like make_experiment(). Also returns the file names that the experiment
/// states.
[[nodiscard]] ExperimentFile make_experiment_file(const ExperimentOptions& options,
                                                  const Experiment& base = {});

/// Sets --unit to the unit that the file of the readings states, unless the options state a unit.
/// If the unit is m/s^2 and the field is gravity, it also sets the unit of the field to m/s^2. The
/// magnitude of gravity is then standard gravity, unless the options state a latitude or a
/// magnitude.
/// @return a note if standard gravity is assumed; otherwise empty.
std::string take_unit_of_file(const std::string& unit, ExperimentOptions& options);

/// @return true if --instrument states one instrument per slot: SLOT=KIND,..
[[nodiscard]] bool states_slots(const ExperimentOptions& options);

/// @return true if a file is an experiment: its name ends in `.json`, and it is not a table of
///         readings.
[[nodiscard]] bool is_experiment_file(const std::string& path);

/// @return the experiment that made a record, reconstructed from the record. Its positioner is the
///         nominal cube.
[[nodiscard]] Experiment experiment_of(const Calibration& record);

}  // namespace axiscal::cli
