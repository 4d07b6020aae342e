// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "adjuster_options.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "axiscal/positioner/surface.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "experiment_options.hpp"
#include "run_input.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

struct LevelCommand {
  ExperimentOptions experiment;
  std::optional<std::string> adjusters, thread_pitch;
  std::string output = "-";
  bool json = false;
};

void add_options(OptionSet& options, LevelCommand& command) {
  add_files(options, command.experiment, Need::required);
  add_experiment_options(options, command.experiment);
  options.add(
      "--adjusters", command.adjusters, "X,Y;..",
      "positions of the height adjusters [m], in the table's frame [default: the positioner's]");
  options.add("--thread-pitch", command.thread_pitch, "M",
              "height by which one turn of an adjuster raises the table [m] [default: the "
              "positioner's]");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

// The present slope of the table.
struct Slope {
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  Eigen::Vector2d standard_error = Eigen::Vector2d::Zero();
  double coverage_factor = 2.0;  // of a 95 % interval
  bool of_last_block = false;

  [[nodiscard]] double size() const { return value.norm(); }

  // Returns the expanded uncertainties (95 %) of the components.
  [[nodiscard]] Eigen::Vector2d expanded() const { return coverage_factor * standard_error; }

  // Returns the expanded uncertainty of size(). If the slope is zero, returns the larger of those
  // of its components.
  [[nodiscard]] double expanded_size() const {
    return size() > 0.0 ? value.cwiseProduct(expanded()).norm() / size() : expanded().maxCoeff();
  }

  [[nodiscard]] bool is_level() const { return (value.array().abs() <= expanded().array()).all(); }
};

bool is_calibration_record(const std::string& path) {
  return path.ends_with(".json") &&
         parse_json(read_whole_file(path), path).text_or("format") == "axiscal-calibration";
}

// Refuses options of `calibrate` if the input is a record, because `level` cannot change a record.
void forbid_options_of_calibrate(const ExperimentOptions& options) {
  for (const auto* option : {&options.instrument,
                             &options.serial,
                             &options.axes,
                             &options.unit,
                             &options.convention,
                             &options.field,
                             &options.field_unit,
                             &options.field_magnitude,
                             &options.field_table,
                             &options.slope,
                             &options.slot,
                             &options.assembly,
                             &options.method,
                             &options.weights,
                             &options.leave_out,
                             &options.level_by,
                             &options.range,
                             &options.also,
                             &options.shape,
                             &options.source,
                             &options.magnetic_model,
                             &options.gravity_model,
                             &options.field_magnitude_u}) {
    if (option->has_value() || options.one_sided) {
      throw UsageError(
          "level: the options of `calibrate` can be used only with readings, because they cannot "
          "change a record");
    }
  }
}

struct Measured {
  std::string path;
  bool from_record = false;
  Calibration calibration;
};

Measured measure(const LevelCommand& command, Surface& surface) {
  const std::vector<std::string>& files = command.experiment.files;
  if (files.size() == 1 && is_calibration_record(files.front())) {
    forbid_options_of_calibrate(command.experiment);
    if (command.experiment.positioner) {
      surface = read_positioner(*command.experiment.positioner).surface();
    }
    return {files.front(), true, read_calibration(files.front())};
  }
  ExperimentOptions options = command.experiment;
  if (!files.front().ends_with(".json")) {  // the file is a table of readings
    options.instrument = options.instrument.value_or("accelerometer");
  }
  ExperimentFile file = make_experiment_file(options);
  Experiment& experiment = file.experiment;
  surface = experiment.positioner.surface();
  const Run run = read_run(file, Units::one, {.faces_of = file.experiment.instrument.kind});
  experiment.positioner =
      with_assembly(experiment.positioner, command.experiment.assembly, run.slots);
  const std::vector<Calibration> calibrations = calibrate_run(experiment, run);
  print_remarks(calibrations);
  // The instruments in all slots lie on the same table, so the warnings of every slot apply to its
  // slope.
  Measured measured{files.front(), false, calibrations.front()};
  for (std::size_t s = 1; s < calibrations.size(); ++s) {
    std::vector<CalibrationWarning>& warnings = measured.calibration.findings.warnings;
    warnings.insert(warnings.end(), calibrations[s].findings.warnings.begin(),
                    calibrations[s].findings.warnings.end());
  }
  return measured;
}

// Checks that the slope may be used to turn the adjusters (levelling screws).
// @throws RefusedError  if warnings, or contradictory slopes from different readings, show that the
//                       slope may be wrong.
void require_trust(const Measured& measured) {
  const Calibration& calibration = measured.calibration;
  const bool spoilt = std::any_of(
      calibration.findings.warnings.begin(), calibration.findings.warnings.end(),
      [](const CalibrationWarning& warning) { return warning_kind(warning.code).spoils_slope; });
  if (spoilt || calibration.findings.status == CalibrationStatus::refused ||
      (calibration.fit.levelness && !calibration.fit.levelness->consistent)) {
    throw RefusedError(
        "level: the readings give contradictory slopes of the table, so no turns are computed; "
        "first correct the faults that the warnings name (repeat these readings, or use "
        "--leave-out or --level-by block)");
  }
}

// Returns the slope from the last block of readings, because the table may have been moved between
// blocks. The readings of several slots are combined.
Slope slope_of(const Measured& measured) {
  const Calibration& calibration = measured.calibration;
  if (!field_kind(calibration.sensor.field.kind).vertical) {
    throw RefusedError(
        formatted("level: the field is {}, but only gravity shows the slope of the table",
                  calibration.sensor.field.kind));
  }
  if (!calibration.fit.levelness && measured.from_record) {
    throw RefusedError(measured.path +
                       ": the record contains no slope of the table (levelness); use the file of "
                       "the readings instead");
  }
  if (!calibration.fit.levelness) {
    throw RefusedError(
        "level: no two readings have the same rest face and opposite fence faces, so the slope of "
        "the table is unknown; read each rest face a second time, turned by 180 degrees");
  }
  const Levelness& levelness = *calibration.fit.levelness;
  const BlockLevelness now = levelness.current_levelness();
  Slope slope{.value = {now.x, now.y},
              .standard_error = {now.standard_error_x, now.standard_error_y},
              .of_last_block = !levelness.blocks.empty()};
  if (levelness.degrees_of_freedom > 0.0) {
    slope.coverage_factor = student_t_factor(0.95, levelness.degrees_of_freedom);
  }
  if (levelness.combined) {
    const CombinedLevelness& all = *levelness.combined;
    slope.value = {all.x, all.y};
    slope.standard_error = {all.standard_error_x, all.standard_error_y};
  }
  if (!(slope.value.squaredNorm() < 1.0)) {
    throw DataError(measured.path, "/levelness/mean",
                    "is not a slope: X^2 + Y^2 must be less than 1");
  }
  return slope;
}

std::string level_json(const Slope& slope,
                       const std::vector<AdjusterMove>& moves,
                       double fence_lean_rad) {
  const auto xy = [](const Eigen::Vector2d& v) -> Json { return {{"x", v.x()}, {"y", v.y()}}; };
  Json json = {{"slope", xy(slope.value)},
               {"u", xy(slope.standard_error)},
               {"expanded_95", xy(slope.expanded())},
               {"level", slope.is_level()},
               {"fence_lean_when_level_rad", fence_lean_rad},
               {"adjusters", Json::array()}};
  for (const AdjusterMove& move : moves) {
    json["adjusters"].push_back({{"x_m", move.position_m.x()},
                                 {"y_m", move.position_m.y()},
                                 {"raise_m", move.raise_m},
                                 {"u_m", move.uncertainty_m},
                                 {"expanded_95_m", slope.coverage_factor * move.uncertainty_m},
                                 {"turns", move.turns ? Json(*move.turns) : Json()}});
  }
  return json_text(json);
}

std::string micro_text(double value) {
  if (!std::isfinite(value)) {
    return "unknown";
  }
  const double size = std::abs(1e6 * value);
  return formatted("{:.{}f}", 1e6 * value, size >= 100.0 ? 0 : size >= 10.0 ? 1 : 2);
}

std::string text_of(const Slope& slope,
                    const std::vector<AdjusterMove>& moves,
                    const Surface& surface) {
  const auto rises = [](double value, char axis) {
    return std::string(value < 0.0 ? "-" : "+") + axis;
  };
  std::string text = wrapped(
      formatted("The slope of the table is {} +- {} urad{} ({} +- {} urad along x, {} +- {} urad "
                "along y); the table rises towards {} and {}. +- is the expanded uncertainty "
                "(95 %).",
                micro_text(slope.size()), micro_text(slope.expanded_size()),
                slope.of_last_block ? " in the last block" : "", micro_text(slope.value.x()),
                micro_text(slope.expanded().x()), micro_text(slope.value.y()),
                micro_text(slope.expanded().y()), rises(slope.value.x(), 'x'),
                rises(slope.value.y(), 'y')),
      80);
  text += formatted("\n\n  {:>10}{:>10}{:>16}{:>8}{:>10}\n", "x [mm]", "y [mm]", "raise by [um]",
                    "+-", "turns");
  for (const AdjusterMove& move : moves) {
    text += formatted("  {:>10.4g}{:>10.4g}{:>16}{:>8}{:>10}\n", 1e3 * move.position_m.x(),
                      1e3 * move.position_m.y(), micro_text(move.raise_m),
                      micro_text(slope.coverage_factor * move.uncertainty_m),
                      move.turns ? formatted("{:.3f}", *move.turns) : "-");
  }
  text += formatted(
      "\n{}\n",
      wrapped(slope.is_level()
                  ? "These readings show no significant slope; more replicates could show one."
                  : "Raise the adjusters by these amounts, then take the 12 readings again.",
              80));
  const double lean = fence_lean_when_level(surface, slope.value);
  if (surface.kind == SurfaceKind::separate) {
    text += wrapped(formatted("The fence is separate from the table. When the table is level, the "
                              "fence leans by {} urad instead of {}; write the new lean to the "
                              "positioner file.",
                              micro_text(lean), micro_text(surface.fence_lean_rad)),
                    80) +
            "\n";
  }
  return text;
}

int run(const LevelCommand& command) {
  Surface surface;
  // Checks the options before the readings are calibrated, because the calibration may take
  // minutes.
  if (command.adjusters) {
    set_adjusters(command.adjusters, command.thread_pitch, surface);
  }
  const Measured measured = measure(command, surface);
  set_adjusters(command.adjusters, command.thread_pitch, surface);
  const Slope slope = slope_of(measured);
  require_trust(measured);
  const Eigen::Matrix2d covariance = slope.standard_error.cwiseAbs2().asDiagonal();
  const std::vector<AdjusterMove> moves = level_table(slope.value, covariance, surface);
  write_text(command.output,
             command.json ? level_json(slope, moves, fence_lean_when_level(surface, slope.value))
                          : text_of(slope, moves, surface));
  return 0;
}

}  // namespace

Subcommand level_subcommand() {
  return make_subcommand<LevelCommand>(
      "level", "compute the turns of the adjusters that level the table",
      "Turn the adjusters as the output says. Take 12 readings again. Repeat this\n"
      "until the output says that the table is level.",
      &add_options, &run);
}

}  // namespace axiscal::cli
