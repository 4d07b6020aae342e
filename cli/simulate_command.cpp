// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/recording.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "core/formatted.hpp"
#include "json_lines.hpp"
#include "run_input.hpp"
#include "sheet_options.hpp"
#include "subcommands.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct SimulateCommand {
  std::vector<std::string> truths;  ///< file names of records; SLOT=RECORD for several slots
  SheetOptions sheet;
  std::optional<std::string> noise, slope, fence_azimuth, positioner, slot, assembly;
  std::optional<std::string> temperature_sd, resolution, world;
  RecordingOptions recording;
  std::string output = "-";
  bool json = false;
};

void write_csv(const SimulateCommand& command, const std::string& csv) {
  write_whole_file(command.output, command.json ? JsonLines().of(csv) : csv);
}

void add_options(OptionSet& options, SimulateCommand& command) {
  options.add_repeated(
      "--truth", command.truths, "RECORD",
      "calibration record of the true instrument; SLOT=RECORD, once for each slot of an assembly");
  add_sheet_options(options, command.sheet);
  options.add("--noise", command.noise, "SD",
              "standard deviation of a reading, in the readings' unit [default: 0]");
  options.add("--slope", command.slope, "X,Y", "slope of the table [default: 0,0]");
  options.add("--temperature-sd", command.temperature_sd, "SD",
              "standard deviation of each temperature about its planned value [default: 0]");
  options.add("--resolution", command.resolution, "Q",
              "readings are rounded to multiples of this step");
  options.add("--world", command.world, "FILE|NAME=V,..",
              ("effects on the readings besides noise: " + world_names()).c_str());
  add_recording_options(options, command.recording);
  options.add("--fence-azimuth", command.fence_azimuth, "DEG",
              "azimuth of the table's y axis; the field of the --truth record is rotated by this "
              "angle");
  options.add("--positioner", command.positioner, "FILE",
              "file of the measured cube: feet or face normals, fence, mounts");
  options.add("--slot", command.slot, "NAME", "mount of the positioner that holds the instrument");
  options.add("--assembly", command.assembly, "NAME",
              "name of the assembly, which states the mount that holds each slot (see `calibrate "
              "--assembly`)");
  options.add_flag("--json", command.json, "rows as JSON, one object per line, instead of CSV");
  options.add_output(command.output);
}

struct Truth {
  std::string slot;  // empty for a single instrument without a slot
  std::string path;
  SensorModel sensor;
};

std::vector<Truth> read_truths(const SimulateCommand& command) {
  std::vector<Truth> truths;
  for (const std::string& text : command.truths) {
    const std::size_t parting = text.find('=');
    // If a file has the whole text as its name, the equals sign belongs to the file name.
    const bool has_slot =
        parting != std::string::npos && !std::filesystem::exists(std::filesystem::path(text));
    if (!has_slot && command.truths.size() > 1) {
      throw UsageError(formatted(
          "--truth: '{}': must be SLOT=RECORD, because --truth is given more than once", text));
    }
    Truth truth{.slot = has_slot ? text.substr(0, parting) : "",
                .path = has_slot ? text.substr(parting + 1) : text,
                .sensor = {}};
    if (has_slot && truth.slot.empty()) {
      throw UsageError(formatted("--truth: '{}': the slot's name is missing", text));
    }
    for (const Truth& other : truths) {
      if (other.slot == truth.slot) {
        throw UsageError(formatted("--truth: slot '{}' is given twice", truth.slot));
      }
    }
    truths.push_back(std::move(truth));
  }
  return truths;
}

SimulationOptions simulation_options(const SimulateCommand& command) {
  SimulationOptions options;
  options.seed = seed_of(command.sheet);
  if (command.noise) {
    options.noise_sd = parse_nonnegative("--noise", *command.noise);
  }
  if (command.temperature_sd) {
    options.temperature_sd = parse_nonnegative("--temperature-sd", *command.temperature_sd);
  }
  if (command.resolution) {
    options.resolution = parse_nonnegative("--resolution", *command.resolution);
  }
  if (command.world) {
    options.world = world_of_option(*command.world);
  }
  if (command.slope) {
    options.slope = slope_of_option(*command.slope);
  }
  if (command.fence_azimuth) {
    options.fence_azimuth_rad = number_of("--fence-azimuth", *command.fence_azimuth) * rad_per_deg;
  }
  return options;
}

// Returns the log of one instrument as CSV with one row per sample. If the recording contains
// rotations, the log also contains the readings of an ideal accelerometer.
std::string recording_csv(const SensorModel& truth,
                          const Recording& recording,
                          const SheetOptions& sheet,
                          const SimulationOptions& options) {
  std::vector<std::string> columns = {"t"};
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(recording.samples), 1);
  const auto append = [&](const Eigen::MatrixXd& more, const std::vector<std::string>& names) {
    const Eigen::Index before = rows.cols();
    rows.conservativeResize(more.rows(), before + more.cols());
    rows.rightCols(more.cols()) = more;
    columns.insert(columns.end(), names.begin(), names.end());
  };
  rows.col(0) = Eigen::VectorXd::LinSpaced(rows.rows(), 0.0, static_cast<double>(rows.rows() - 1)) /
                recording.rate_hz;
  if (recording.kind == RecordingKind::turns) {
    const SimulatedTurns turns =
        simulate_turns(truth, make_sheet(sheet), recording, Eigen::Vector3d::Zero(), options);
    append(turns.up, {"ax", "ay", "az"});
    append(turns.readings, truth.instrument.axes);
  } else {
    const Observations all = simulate_recording(truth, recording, options).observations;
    if (recording.kind == RecordingKind::sweep) {
      Eigen::VectorXd temperatures(all.size());
      for (Eigen::Index i = 0; i < all.size(); ++i) {
        temperatures(i) = all.readings[static_cast<std::size_t>(i)].temperature->mean();
      }
      append(temperatures, {"temperature"});
    }
    append(all.response, truth.instrument.axes);
  }
  std::transform(columns.begin(), columns.end(), columns.begin(), &formula_safe_cell);
  std::string text = joined(columns, ",") + "\n";
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    for (Eigen::Index c = 0; c < rows.cols(); ++c) {
      text += (c > 0 ? "," : "") + number_text(rows(i, c));
    }
    text += "\n";
  }
  return text;
}

int run(const SimulateCommand& command) {
  SimulationOptions options = simulation_options(command);
  std::vector<Truth> truths = read_truths(command);
  std::optional<Recording> recording = recording_of(command.recording);
  const std::vector<double> temperatures = temperatures_of(command.sheet);
  if (recording && temperatures.size() > 1) {
    recording->temperatures = {temperatures.front(), temperatures.back()};
  }
  if (recording && (truths.size() > 1 || command.assembly)) {
    throw UsageError("--recording: requires exactly one instrument");
  }
  std::vector<std::string> slots;
  for (Truth& truth : truths) {
    truth.sensor = with_field_of_site(read_calibration(truth.path).sensor);
    if (command.slope) {
      truth.sensor = on_level_table(std::move(truth.sensor));
    }
    slots.push_back(truth.slot);
  }
  if (command.positioner) {
    options.positioner = read_positioner(*command.positioner);
  }
  options.positioner = with_assembly(options.positioner, command.assembly,
                                     slots.front().empty() ? std::vector<std::string>{} : slots);
  if (recording) {
    const std::string slot =
        truths.front().slot.empty() ? command.slot.value_or("") : truths.front().slot;
    options.rotation_sensor_from_positioner = mount_rotation(options.positioner, slot);
    write_csv(command, recording_csv(truths.front().sensor, *recording, command.sheet, options));
    return 0;
  }
  // All instruments are read in the same poses, but with independent noise.
  const std::vector<RunSheetRow> sheet = make_sheet(command.sheet);
  Observations all;
  std::vector<std::string> columns;
  for (const Truth& truth : truths) {
    const std::string slot = truth.slot.empty() ? command.slot.value_or("") : truth.slot;
    options.rotation_sensor_from_positioner = mount_rotation(options.positioner, slot);
    Observations own = simulate(truth.sensor, sheet, options);
    ++options.stream;
    for (const std::string& axis : truth.sensor.instrument.axes) {
      columns.push_back(truth.slot.empty() ? axis : formatted("{}.{}", truth.slot, axis));
    }
    if (all.readings.empty()) {
      all = std::move(own);
    } else {
      Eigen::MatrixXd response(all.response.rows(), all.response.cols() + own.response.cols());
      response << all.response, own.response;
      all.response = std::move(response);
    }
  }
  write_csv(command, observations_csv(all, columns));
  return 0;
}

}  // namespace

Subcommand simulate_subcommand() {
  return make_subcommand<SimulateCommand>("simulate", "simulate the readings of a known instrument",
                                          "", &add_options, &run);
}

}  // namespace axiscal::cli
