// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/temperature.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "axiscal/report/run_sheet_page.hpp"
#include "core/formatted.hpp"
#include "input.hpp"
#include "plan_text.hpp"
#include "sheet_options.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct PlanCommand {
  std::optional<std::string> experiment;  ///< file of the experiment to plan
  SheetOptions sheet;
  std::optional<std::string> noise_log, dwell;
  std::optional<std::string> noise, samples, want_angle, sensitivity, method, positioner, world;
  std::optional<std::string> positioner_u, level_u, slope, slot, page, tolerances, trials;
  std::optional<std::string> soak, soak_window, soak_tolerance;
  std::optional<std::string> output;
  bool json = false;
};

void add_options(OptionSet& options, PlanCommand& command) {
  options.add("experiment", command.experiment, "EXPERIMENT",
              "experiment file (.json) with instrument, field, cube and method");
  add_sheet_options(options, command.sheet);
  OptionSet forecast = options.group("Forecast");
  forecast.add("--noise", command.noise, "SD",
               "standard deviation of one sample, in the readings' unit");
  forecast.add(
      "--noise-log", command.noise_log, "FILE",
      "output of `noise --json`, instead of --noise; a reading is the mean over the dwell time");
  forecast.add(
      "--dwell", command.dwell, "S",
      "time at a design point [s], with --noise-log [default: computed for the noisiest axis]");
  forecast.add("--samples", command.samples, "N",
               "number of samples averaged at each point [default: 1]");
  forecast.add("--want-angle-deg", command.want_angle, "U",
               "wanted standard uncertainty of an angle, from which the number of replicates is "
               "computed");
  forecast.add("--sensitivity", command.sensitivity, "S",
               "nominal sensitivity of each axis [default: 1]");
  forecast.add("--method", command.method, "METHOD",
               "paired, joint or known [default: chosen from the design]");
  forecast.add("--positioner", command.positioner, "FILE",
               "file of the measured cube [default: the nominal cube]");
  forecast.add("--positioner-u", command.positioner_u, "RAD",
               "standard uncertainty of each face normal, in addition to the positioner's "
               "covariance");
  forecast.add("--slot", command.slot, "NAME",
               "mount of the positioner that holds the instrument; its repeatability is included");
  forecast.add("--level-u", command.level_u, "RAD",
               "method 'known': standard uncertainty of the table's slope along x and y");
  forecast.add(
      "--world", command.world, "FILE|NAME=V,..",
      ("effects on the readings besides white noise; each replicate is a block: " + world_names())
          .c_str());
  forecast.add("--slope", command.slope, "X,Y", "expected slope of the table [default: 0,0]");
  OptionSet tolerances = options.group("Tolerances");
  tolerances.add("--tolerances", command.tolerances, "NAME=SD,..",
                 "standard deviations of the errors with which the cube is made: foot_height_m, "
                 "ball_radius_m, squareness_rad, fence_rad");
  tolerances.add("--trials", command.trials, "N", "number of simulated cubes [default: 1000]");
  OptionSet temperature = options.group("Temperature");
  temperature.add(
      "--soak", command.soak, "LOG",
      "test whether the temperature in a log (CSV: time [s], temperature) is steady; the exit "
      "status is 1 if it is not");
  temperature.add("--soak-window", command.soak_window, "S",
                  "duration of the last part of the log that is tested, and of the next block [s] "
                  "[default: 300]");
  temperature.add("--soak-tolerance", command.soak_tolerance, "T",
                  "largest change of the temperature output within --soak-window [default: 0.1]");
  options.add("--page", command.page, "SHEET.html", "file for the run sheet as a page to print");
  options.add("-o,--output", command.output, "FILE",
              "file of the run sheet (CSV) [default: -, stdout]");
  options.add_flag("--json", command.json, "print the forecast as JSON");
}

// Returns the experiment that the user's file describes. Without a file, returns an experiment with
// an accelerometer in gravity.
Experiment planned_experiment(const PlanCommand& command) {
  Experiment experiment;
  if (command.experiment) {
    experiment = read_experiment(*command.experiment).experiment;
  }
  if (experiment.instrument.kind.empty()) {
    experiment.instrument.kind = "accelerometer";
  }
  set_default_field(experiment);
  if (command.positioner) {
    experiment.positioner = read_positioner(*command.positioner);
  }
  if (command.slope) {
    experiment.table.slope = slope_of_option(*command.slope);
  }
  if (command.method) {
    experiment.fit.method = method_of_option(*command.method);
  }
  experiment.slot = command.slot.value_or(experiment.slot);
  return experiment;
}

bool states_noise(const PlanCommand& command) {
  return command.noise || command.noise_log;
}

// Returns the noise for the forecast: the standard deviation of one sample (--noise), or the Allan
// deviation of the samples in the file --noise-log at the dwell time.
// @param kind  kind of the planned instrument.
double noise_of(const PlanCommand& command, const std::string& kind) {
  if (command.dwell && !command.noise_log) {
    throw UsageError("--dwell: requires --noise-log FILE");
  }
  if (!command.noise_log) {
    return command.noise ? parse_nonnegative("--noise", *command.noise) : 0.0;
  }
  if (command.noise || command.samples) {
    throw UsageError("--noise-log: cannot be combined with --noise or --samples");
  }
  const LogNoise noise = parse_noise(read_whole_file(*command.noise_log), *command.noise_log);
  const std::vector<const ColumnNoise*> columns = columns_of_instrument(noise, kind);
  const ColumnNoise* const worst = *std::max_element(
      columns.begin(), columns.end(), [](const ColumnNoise* a, const ColumnNoise* b) {
        return a->dwell.sensible_deviation < b->dwell.sensible_deviation;
      });
  if (columns.size() < noise.columns.size()) {
    std::string names;
    for (const ColumnNoise* const column : columns) {
      names += (names.empty() ? "" : ", ") + column->name;
    }
    print_remark(
        "note",
        formatted("only the columns {} of the noise log are used, because they have the same "
                  "unit",
                  names));
  }
  const double dwell_s =
      command.dwell ? parse_positive("--dwell", *command.dwell) : worst->dwell.sensible_s;
  if (dwell_s > worst->curve.back().tau_s) {
    print_remark("warning",
                 formatted("the noise log does not show the noise of averages over more than {} s; "
                           "the uncertainties forecast for a dwell time of {} s may be far too "
                           "small",
                           number_text(worst->curve.back().tau_s, 3), number_text(dwell_s, 3)));
  }
  double largest = 0.0;
  for (const ColumnNoise* const column : columns) {
    largest = std::max(largest, deviation_at(column->curve, dwell_s));
  }
  print_remark("note", formatted("the dwell time at each design point is {} s; a reading, the mean "
                                 "over this time, has a standard deviation of {} on the noisiest "
                                 "axis",
                                 number_text(dwell_s, 3), number_text(largest, 3)));
  return largest;
}

ForecastSetup setup_of(const PlanCommand& command,
                       const Experiment& experiment,
                       const std::vector<DesignEntry>& design) {
  const double sensitivity =
      command.sensitivity ? number_of("--sensitivity", *command.sensitivity) : 1.0;
  if (!(std::abs(sensitivity) > 0.0)) {
    throw UsageError("--sensitivity: must not be 0");
  }
  ForecastSetup setup = forecast_setup(experiment, design, sensitivity);
  setup.replicates = replicates_of(command.sheet);
  setup.noise_sd = noise_of(command, experiment.instrument.kind);
  setup.samples = command.samples ? parse_whole_number("--samples", *command.samples, 1) : 1;
  setup.normal_u_rad =
      command.positioner_u ? parse_nonnegative("--positioner-u", *command.positioner_u) : 0.0;
  setup.level_u_rad = command.level_u ? parse_nonnegative("--level-u", *command.level_u) : 0.0;
  if (command.world) {
    setup.world = world_of_option(*command.world);
  }
  return setup;
}

ToleranceStudy tolerance_study(const PlanCommand& command,
                               const ForecastSetup& setup,
                               const Positioner& positioner) {
  ToleranceStudy study;
  study.nominal = setup.nominal;
  study.design = setup.design;
  study.drawing = positioner.drawing();
  study.surface = positioner.surface();
  study.tolerances = tolerances_of(*command.tolerances);
  study.slope = setup.slope;
  study.seed = seed_of(command.sheet);
  if (command.trials) {
    study.trials = parse_whole_number("--trials", *command.trials, 1);
  }
  return study;
}

std::vector<std::string> remarks_on(const ForecastSetup& setup) {
  std::set<DesignPoint> points;
  for (const DesignEntry& entry : setup.design) {
    points.insert(entry.point);
  }
  std::vector<std::string> remarks = rocking_remarks(setup.positioner, points);
  if (method_kind(setup.method).directions_known && !(setup.level_u_rad > 0.0)) {
    remarks.emplace_back(
        "The method 'known' assumes that the table's slope is known exactly; --level-u sets the "
        "uncertainty of the slope.");
  }
  return remarks;
}

void check_outputs(const PlanCommand& command) {
  if (command.page == "-") {
    throw UsageError(
        "--page: requires a file, because standard output is for the sheet and the forecast");
  }
  if (command.page && command.page == command.output) {
    throw UsageError("--page: the page and the sheet must be different files");
  }
  if (command.trials && !command.tolerances) {
    throw UsageError("--trials: requires --tolerances");
  }
}

// Returns the smallest number of replicates that reaches the wanted uncertainty of an angle.
int needed_replicates(const ForecastSetup& setup, double wanted_rad, bool makes_sheet) {
  constexpr int longest_sheet = 1000;
  const std::optional<double> needed = replicates_for_angle(setup, wanted_rad);
  if (!needed) {
    ForecastSetup silent = setup;
    silent.noise_sd = 0.0;
    const Forecast rest = forecast(silent);
    throw RefusedError(formatted(
        "--want-angle-deg: no number of replicates reaches {} degrees, because the uncertainties "
        "of the cube and of the table's slope alone give {} degrees; measure the cube better "
        "(`characterize`), or estimate the slope (method 'paired' or 'joint')",
        short_degrees(wanted_rad),
        short_degrees(largest_angle_uncertainty(rest, rest.covariance()))));
  }
  if (makes_sheet && *needed > longest_sheet) {
    throw RefusedError(
        formatted("--want-angle-deg: {} degrees need {} replicates (samples per point: {}), which "
                  "is too many for a run sheet. Average more samples at each point (--samples), "
                  "or set --replicates",
                  short_degrees(wanted_rad), formatted("{:.0f}", *needed), setup.samples));
  }
  return static_cast<int>(std::min(*needed, 1e9));
}

// Reports whether the temperature in a log is steady.
// @return the exit status: 0 if it is steady, 1 if it is not.
int tell_soak(const PlanCommand& command) {
  const OpenTable table = open_table(*command.soak, {}, {});
  CsvReader& csv = *table.csv;
  const std::size_t time = csv.need("time");
  const std::size_t temperature = csv.need("temperature");
  std::vector<double> times;
  std::vector<double> temperatures;
  for (CsvReader::Row row = csv.next(); row != CsvReader::Row::end; row = csv.next()) {
    if (row == CsvReader::Row::defective) {
      throw DataError(csv.path(), csv.line(), csv.defect());
    }
    const std::string text(csv.cells()[time]);
    const std::optional<double> t = parse_number(text) ? parse_number(text) : parse_timestamp(text);
    const std::optional<double> value = parse_number(csv.cells()[temperature]);
    if (!t || !value || (!times.empty() && *t < times.back())) {
      throw DataError(csv.path(), csv.line(),
                      "this row must have a temperature, and a time that is not earlier than in "
                      "the previous row");
    }
    times.push_back(*t);
    temperatures.push_back(*value);
  }
  const double window =
      command.soak_window ? number_of("--soak-window", *command.soak_window) : 300.0;
  const double tolerance =
      command.soak_tolerance ? number_of("--soak-tolerance", *command.soak_tolerance) : 0.1;
  if (!(window > 0.0) || !(tolerance > 0.0)) {
    throw UsageError("--soak-window and --soak-tolerance: must be positive");
  }
  const SoakState state = soak_state(times, temperatures, window, tolerance);
  std::string text;
  if (std::isnan(state.rate)) {
    text =
        formatted("not steady: the log is shorter than the window of {} s\n", number_text(window));
  } else {
    text = formatted(
        "{}: the temperature changes by {:.2g} in {:g} s (standard uncertainty "
        "{:.1g}; allowed {:g})\n",
        state.steady ? "steady" : "not steady", state.rate * window, window, state.rate_u * window,
        tolerance);
    if (!state.steady && !std::isnan(state.remaining_s)) {
      text += formatted("steady in about {:.0f} s\n", state.remaining_s);
    }
  }
  write_text(command.output.value_or("-"), text);
  return state.steady ? 0 : 1;
}

int run(const PlanCommand& command) {
  if (command.soak) {
    return tell_soak(command);
  }
  if (command.json && command.output == "-") {
    throw UsageError(
        "-o -: the sheet and the JSON of the forecast cannot both go to standard output");
  }
  if (command.want_angle && !states_noise(command)) {
    throw UsageError("--want-angle-deg: requires the noise of a sample (--noise)");
  }
  check_outputs(command);
  const Experiment experiment = planned_experiment(command);
  Plan plan;
  plan.optimal = optimal_design_of(command.sheet);
  const std::vector<DesignEntry> design =
      plan.optimal ? plan.optimal->design : design_of(command.sheet);
  plan.setup = setup_of(command, experiment, design);
  plan.remarks = remarks_on(plan.setup);
  const Eigen::Vector3d field =
      plan.setup.nominal.field.in_table.value_or(Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
  plan.quality = assess_design(design, experiment.positioner, field);
  if (command.want_angle) {
    plan.wanted_rad = parse_positive("--want-angle-deg", *command.want_angle) * rad_per_deg;
    plan.replicates_needed =
        needed_replicates(plan.setup, *plan.wanted_rad, !command.sheet.replicates);
    if (!command.sheet.replicates) {
      plan.setup.replicates = plan.replicates_needed;
    }
  }
  if (states_noise(command)) {
    plan.forecast = forecast(plan.setup);
  }
  if (command.tolerances) {
    plan.tolerances = study_tolerances(tolerance_study(command, plan.setup, experiment.positioner));
  }
  const std::vector<RunSheetRow> sheet = make_run_sheet(
      design, plan.setup.replicates, seed_of(command.sheet), temperatures_of(command.sheet));
  // The forecast is printed on stdout. If the sheet is printed there, the forecast is printed on
  // stderr.
  const bool forecast_to_stdout = command.output.value_or("-") != "-" || command.json;
  if (command.output || !command.json) {
    write_text(command.output.value_or("-"), run_sheet_csv(sheet, experiment.instrument.axes));
  }
  if (command.page) {
    const std::string& serial = experiment.instrument.serial;
    write_whole_file(*command.page,
                     run_sheet_page(sheet, experiment.instrument,
                                    "Run sheet" + (serial.empty() ? "" : " of " + serial)));
  }
  const std::string text = command.json ? plan_json(plan) : plan_text(plan);
  if (forecast_to_stdout) {
    write_text("-", text);
  } else {
    print_line(text.ends_with('\n') ? text.substr(0, text.size() - 1) : text);
  }
  return 0;
}

}  // namespace

Subcommand plan_subcommand() {
  return make_subcommand<PlanCommand>(
      "plan", "write a run sheet, and forecast the uncertainties",
      "Without -o the sheet goes to stdout and the forecast to stderr.", &add_options, &run);
}

}  // namespace axiscal::cli
