// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>

#include <unistd.h>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/study.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "core/formatted.hpp"
#include "experiment_options.hpp"
#include "sheet_options.hpp"
#include "stream_files.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct StudyCommand {
  std::optional<std::string> truth;
  std::vector<std::string> merge;
  ExperimentOptions experiment;
  SheetOptions sheet;
  std::optional<std::string> trials, shard, noise, slope_sd, temperature_sd, tolerances, world;
  RecordingOptions recording;
  std::string output = "-";
  bool random_normals = false;
  bool regression_only = false;
  bool alarms = false;
  bool json = false;
};

void add_options(OptionSet& options, StudyCommand& command) {
  options.add("experiment", command.experiment.files, "EXPERIMENT", "experiment (.json)");
  options.add("--truth", command.truth, "RECORD", "record of the true instrument and field");
  add_experiment_options(options, command.experiment);
  add_sheet_options(options, command.sheet);
  options.add("--trials", command.trials, "N",
              "number of runs that are simulated and calibrated [default: 1000]");
  options.add("--shard", command.shard, "I/N",
              "compute only part I of N of the trials; --merge joins the parts");
  options.add(
      "--noise", command.noise, "SD[,SD..]",
      "standard deviation of a reading: one number for all axes, or one for each axis [default: "
      "residual_sd of the --truth record]");
  options.add("--slope-sd", command.slope_sd, "RAD",
              "standard deviation of an additional random slope of the table in each run, along x "
              "and y [default: 0]");
  options.add("--temperature-sd", command.temperature_sd, "SD",
              "standard deviation of each temperature about its planned value [default: 0]");
  options.add("--tolerances", command.tolerances, "NAME=SD,..",
              "standard deviations of the random errors of the cube, which are drawn for each run "
              "and are unknown to the calibration");
  options.add_flag("--random-normals", command.random_normals,
                   "draw the face normals of the cube in each run at random, with the "
                   "normal_covariance of --positioner");
  options.add_flag("--regression-only", command.regression_only,
                   "simulate only noise, in an exactly known field; this computes millions of "
                   "trials per second");
  options.add("--world", command.world, "FILE|NAME=V,..",
              ("effects on the readings besides noise: " + world_names()).c_str());
  add_recording_options(options, command.recording);
  options.add_flag("--alarms", command.alarms,
                   "look for mistakes in every run and count the trials with each warning");
  options.add("--merge", command.merge, "FILES", "join the outputs of --shard");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

// Returns the number of finished trials, including those in which the calibration failed.
std::int64_t trials_done(const Study& study) {
  std::int64_t done = 0;
  for (const std::int64_t block : study.blocks) {
    done += std::min(study.block, study.trials - block * study.block);
  }
  return done;
}

std::string study_text(const Study& study) {
  std::string text = formatted("trials: {}, seed {}", study.trials, study.seed);
  text +=
      study.refused > 0 ? formatted("; trials without a calibration: {}\n", study.refused) : "\n";
  text += formatted("  {:<20}{:>13}{:>13}{:>13}{:>12}\n", "", "mean error", "sd", "stated u",
                    "coverage");
  for (const StudyResult& result : results_of(study)) {
    text += formatted("  {:<20}{:>13.2e}{:>13.4e}{:>13.4e}{:>10.2f} %\n", result.parameter,
                      result.mean_error, result.sd, result.stated_u, 100.0 * result.coverage_95);
  }
  for (const auto& [name, count] : study.warnings) {
    text += formatted("  warning {:<28}{:>10.3f} % of the trials\n", name,
                      100.0 * static_cast<double>(count) / static_cast<double>(trials_done(study)));
  }
  return text;
}

int merge_shards(const StudyCommand& command) {
  std::vector<std::string> files = command.merge;
  files.insert(files.end(), command.experiment.files.begin(), command.experiment.files.end());
  std::vector<Study> shards;
  for (const std::string& file : files) {
    shards.push_back(parse_study(read_whole_file(file), file));
  }
  Study all;
  try {
    all = merge(shards);
  } catch (const DomainError& error) {
    throw DataError(files.front(), error.what(), error.settings());
  }
  const std::int64_t blocks = block_count(all);
  if (static_cast<std::int64_t>(all.blocks.size()) < blocks) {
    print_remark("warning",
                 formatted("the files contain only {} of {} blocks of trials; a shard is missing",
                           all.blocks.size(), blocks));
  }
  write_text(command.output, command.json ? study_json(all, false) : study_text(all));
  return static_cast<std::int64_t>(all.blocks.size()) < blocks ? 1 : 0;
}

// Returns the standard deviation of a reading for each axis.
// @param m        number of axes.
// @param scatter  standard deviations of a record's readings, used without --noise; may be empty.
Eigen::VectorXd noise_of(const StudyCommand& command,
                         Eigen::Index m,
                         const Eigen::VectorXd& scatter) {
  if (!command.noise) {
    if (scatter.size() == m && (scatter.array() > 0.0).all()) {
      return scatter;
    }
    throw UsageError("study: give the noise of a reading (--noise SD)");
  }
  if (command.noise->find(',') == std::string::npos) {
    return Eigen::VectorXd::Constant(m, parse_nonnegative("--noise", *command.noise));
  }
  const std::vector<double> all =
      numbers_of("--noise", *command.noise, static_cast<std::size_t>(m));
  return Eigen::Map<const Eigen::VectorXd>(all.data(), m);
}

StudySetup setup_of(const StudyCommand& command) {
  StudySetup setup;
  const bool has_truth = command.truth.has_value();
  if (has_truth == !command.experiment.files.empty()) {
    throw UsageError("study: give either an EXPERIMENT.json or --truth RECORD.json");
  }
  Eigen::VectorXd scatter;  // standard deviations of the record's readings
  if (has_truth) {
    const Calibration record = read_calibration(*command.truth);
    setup.truth = record.sensor;
    scatter = record.fit.statistics ? record.fit.statistics->residual_sd : scatter;
    setup.experiment = make_experiment(command.experiment, experiment_of(record));
    if (setup.truth.temperature && !command.experiment.temperature_order) {
      setup.experiment.fit.temperature.order =
          static_cast<int>(std::min<Eigen::Index>(setup.truth.temperature->bias.cols(), 2));
    }
  } else {
    setup.experiment = make_experiment(command.experiment);
    setup.truth =
        nominal_sensor(setup.experiment, setup.experiment.nominal_sensitivity.value_or(1.0));
  }
  if (!setup.truth.field.in_table) {
    setup.truth.field.in_table = setup.truth.field.magnitude * Eigen::Vector3d::UnitZ();
  }
  if (method_kind(setup.experiment.fit.method).directions_known &&
      !setup.experiment.field.in_table) {
    setup.experiment.field.in_table = setup.truth.field.in_table;
  }
  setup.design = design_of(command.sheet);
  setup.replicates = replicates_of(command.sheet);
  setup.temperatures = temperatures_of(command.sheet);
  setup.noise_sd = noise_of(command, setup.truth.instrument.axis_count(), scatter);
  setup.simulation.resolution = setup.experiment.stated.resolution;
  if (!method_kind(setup.experiment.fit.method).directions_known) {
    setup.simulation.slope = setup.experiment.table.slope;
    setup.experiment.table.slope.setZero();
  }
  if (command.temperature_sd) {
    setup.simulation.temperature_sd =
        parse_nonnegative("--temperature-sd", *command.temperature_sd);
  }
  if (command.slope_sd) {
    setup.slope_sd = parse_nonnegative("--slope-sd", *command.slope_sd);
  }
  if (command.world) {
    setup.simulation.world = world_of_option(*command.world);
  }
  setup.recording = recording_of(command.recording);
  if (setup.recording && setup.recording->kind == RecordingKind::free &&
      !setup.experiment.fit.method) {
    setup.experiment.fit.method = Method::magnitude;
  }
  setup.alarms = command.alarms;
  setup.random_normals = command.random_normals;
  setup.regression_only = command.regression_only;
  if (command.tolerances) {
    setup.tolerances = tolerances_of(*command.tolerances);
    setup.drawing = setup.experiment.positioner.drawing();
    setup.surface = setup.experiment.positioner.surface();
  }
  if (setup.truth.temperature && setup.temperatures.empty()) {
    throw UsageError(
        "study: the record of --truth has temperature coefficients; give the temperatures of the "
        "soaks (--temperatures T,T,..)");
  }
  return setup;
}

int run(const StudyCommand& command) {
  if (!command.merge.empty()) {
    return merge_shards(command);
  }
  const StudySetup setup = setup_of(command);
  std::int64_t trials = 1000;
  if (command.trials) {
    trials = parse_whole_number("--trials", *command.trials, 1);
  }
  const Shard shard = command.shard ? shard_of_option(*command.shard) : Shard{};
  const auto mine = trials / shard.count;
  const auto progress = [&](std::int64_t done) {
    print_progress(formatted("{} of {} trials", done, std::max(mine, done)));
  };
  Study study;
  try {
    study = run_study(setup, trials, seed_of(command.sheet), shard, progress);
  } catch (const SetupError&) {
    throw;
  } catch (const DomainError& error) {
    throw UsageError("study", error);
  }
  print_progress("");
  const bool machine = command.json || command.shard;
  write_text(command.output,
             machine ? study_json(study, command.shard.has_value()) : study_text(study));
  return 0;
}

}  // namespace

Subcommand study_subcommand() {
  return make_subcommand<StudyCommand>(
      "study", "simulate many runs, and compare errors with uncertainties",
      "On several processors:\n"
      "  parallel axiscal study --truth cal.json --noise 1e-4 --trials 100000 \\\n"
      "    --seed 7 --shard {}/8 -o part{}.json ::: 1 2 3 4 5 6 7 8\n"
      "  axiscal study --merge part*.json",
      &add_options, &run);
}

}  // namespace axiscal::cli
