// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "axiscal/core/error.hpp"

namespace axiscal::cli {

/// The command line is wrong: exit status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// Options that describe an experiment, as typed.
struct ExperimentOptions {
  std::vector<std::string> files;
  std::optional<std::string> instrument, serial, axes, unit, convention, range;
  std::optional<std::string> field, also, field_unit, field_magnitude, field_magnitude_u,
      field_table;
  std::optional<std::string> magnetic_model, gravity_model, source;
  std::optional<std::string> latitude, longitude, height, date;
  std::optional<std::string> fence_azimuth, slope, positioner, slot, assembly;
  std::optional<std::string> method, shape, weights, leave_out, level_by, noise_ratio;
  std::optional<std::string> temperature_order, temperature_reference, from;
  std::optional<std::string> resolution, slope_u, direction_u, temperature_u;
  std::optional<std::string> nominal_sensitivity;
  bool robust = false;
  bool one_sided = false;
  bool polar_fit = false;
};

/// How a raw log is read, as typed.
struct LogOptions {
  std::optional<std::string> names, map, time, rate;
};

/// How a raw log is cut into rests, as typed.
struct RestOptions {
  LogOptions log;
  std::optional<std::string> window, shortest, trim, threshold, range;
  std::optional<std::string> plan;
  std::optional<std::string> columns, first_fence;
  std::optional<std::string> accelerometer, gyroscope, magnetometer, gyroscope_scale;
};

struct CalibrateCommand {
  ExperimentOptions experiment;
  std::optional<std::string> imu;  ///< a raw log instead of observations
  RestOptions rests;
  std::optional<std::string> gyroscope_unit, magnetometer_unit, magnetic_magnitude;
  bool cube = false;
  bool fit_gyroscope_bias = false;
  std::optional<std::string> output;
  std::optional<std::string> limits, table;
  std::optional<std::string> align;  ///< record of an instrument that was recorded together
  bool json = false;
  bool force = false;
  bool accept_suggestion = false;
};

struct SegmentCommand {
  std::string log;
  RestOptions rests;
  std::string output = "-";
  bool recognise = false;
  bool keep_split = false;
  bool json = false;
};

struct NoiseCommand {
  std::string log;
  LogOptions options;
  std::optional<std::string> columns;
  std::string output = "-";
  bool all_taus = false;
  bool json = false;
};

struct ApplyCommand {
  std::string record;
  std::string readings;
  std::string output = "-";
  std::optional<std::string> field_magnitude, field_unit, yaw_above, pitch;
  std::optional<std::string> attitude, declination, latitude, longitude, height, gravity_model;
  std::optional<std::string> noise, resolution, temperature_u, temperature_column;
  bool uncertainty = false;
  bool follow = false;
  bool strict = false;
  bool force = false;
};

/// Options of a run sheet, as typed.
struct SheetOptions {
  std::string design = "12";
  std::optional<std::string> replicates, seed, temperatures;
};

struct PlanCommand {
  std::optional<std::string> experiment;  ///< a file that describes what is planned
  SheetOptions sheet;
  std::optional<std::string> noise_log, dwell;
  std::optional<std::string> noise, samples, want_angle, sensitivity, method, positioner;
  std::optional<std::string> positioner_u, level_u, slope, slot, page, tolerances, trials;
  std::optional<std::string> soak, soak_window, soak_tolerance;
  std::optional<std::string> output;
  bool json = false;
};

struct SimulateCommand {
  std::vector<std::string> truths;  ///< a record, or SLOT=RECORD for each slot
  SheetOptions sheet;
  std::optional<std::string> noise, slope, fence_azimuth, positioner, slot, assembly;
  std::optional<std::string> temperature_sd, resolution;
  std::string output = "-";
};

struct LevelCommand {
  ExperimentOptions experiment;
  std::optional<std::string> adjusters, thread_pitch;
  std::string output = "-";
  bool json = false;
};

struct CharacterizeCommand {
  std::vector<std::string> references;  ///< RECORD=OBSERVATIONS
  std::string id;
  std::string output;
  std::optional<std::string> drawing, level_by, leave_out;
  bool hold_bias_and_scale = false;
  bool json = false;
};

struct FieldCommand {
  std::optional<std::string> latitude, longitude, height, date, only;
  std::optional<std::string> magnetic_model, gravity_model;
  std::string output = "-";
  bool refraction = false;
  bool json = false;
};

struct CheckCommand {
  std::string record;
  std::optional<std::string> other;  ///< observations or another record
  ExperimentOptions experiment;      ///< that differ from the record's
  std::optional<std::string> history, limits, alpha;
  std::string output = "-";
  bool json = false;
};

struct BudgetCommand {
  std::string record;
  std::optional<std::string> pitch, roll, temperature, noise, map, monte_carlo, seed, pitch_formula;
  std::string output = "-";
  bool json = false;
};

struct StudyCommand {
  std::optional<std::string> truth;
  std::vector<std::string> merge;
  ExperimentOptions experiment;
  SheetOptions sheet;
  std::optional<std::string> trials, shard, noise, slope_sd, temperature_sd, tolerances;
  std::string output = "-";
  bool random_normals = false;
  bool regression_only = false;
  bool json = false;
};

struct ExportCommand {
  std::string record;
  std::optional<std::string> format, reading_factor, gravity, numbers, name, instance;
  std::optional<std::string> laboratory;
  std::string output = "-";
  bool list = false;
  bool lossy = false;
  bool force = false;
};

struct ImportCommand {
  std::string file;
  std::optional<std::string> format, instrument, instance, magnitude;
  std::string output = "-";
};

struct ReportCommand {
  std::string record;
  std::optional<std::string> observations, history, noise, laboratory, positioner, adjusters,
      thread_pitch;
  std::string output;
};

struct AcquireCommand {
  std::vector<std::string> arguments;  ///< as typed: a journal keeps them
  std::vector<std::string> sources;
  ExperimentOptions experiment;
  SheetOptions sheet;
  std::optional<std::string> plan, noise, window, dwell, placement_u;
  std::optional<std::string> soak_window, soak_tolerance, temperature_column;
  std::optional<std::string> name, journal, resume, output, record, report;
  std::optional<std::string> check, readings, within;
  std::optional<std::string> listen, port;
  bool list = false;
  bool manual = false;
  bool unattended = false;
  bool raw = false;
  bool plain = false;
  bool json = false;
  bool web = false;
};

struct TemplateCommand {
  std::string name;
  std::string output = "-";
};

/// Text for standard output and nothing more to do: help or version.
struct ShowText {
  std::string text;
};

using Command = std::variant<ShowText,
                             CalibrateCommand,
                             ApplyCommand,
                             PlanCommand,
                             SimulateCommand,
                             LevelCommand,
                             CharacterizeCommand,
                             FieldCommand,
                             CheckCommand,
                             BudgetCommand,
                             StudyCommand,
                             SegmentCommand,
                             NoiseCommand,
                             ExportCommand,
                             ImportCommand,
                             ReportCommand,
                             AcquireCommand,
                             TemplateCommand>;

/// @throws UsageError  for an unknown subcommand, option or value, or one that is missing.
[[nodiscard]] Command parse_command_line(std::vector<std::string> arguments);

}  // namespace axiscal::cli
