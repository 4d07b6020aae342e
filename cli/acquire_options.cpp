// SPDX-License-Identifier: Apache-2.0
#include "acquire_options.hpp"

#include <array>

#include "axiscal/core/error.hpp"
#include "command_line.hpp"
#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

void add_options(OptionSet& options, AcquireCommand& command) {
  command.arguments = options.typed();
  options.add("experiment", command.experiment.files, "FILE",
              "experiment file (.json) with instrument, field, cube and method");
  OptionSet source = options.group("Source");
  source.add(
      "--connect", command.sources, "ADDRESS",
      "address of the instrument; --list shows the kinds of addresses. If several are given, "
      "readings are taken at the sample times of the first");
  source.add_flag("--list", command.list, "list connected devices and the kinds of sources");
  source.add("--temperature-column", command.temperature_column, "NAME",
             "name of the temperature channel [default: temperature]");
  add_experiment_options(options, command.experiment);
  add_sheet_options(options, command.sheet);
  OptionSet session = options.group("Session");
  session.add("--plan", command.plan, "SHEET", "run sheet to follow, instead of a design");
  session.add("--noise", command.noise, "SD|FILE",
              "standard deviation of a sample at rest, or the output of `noise --json`: sets the "
              "threshold for stillness and the dwell time [default: estimated during the session]");
  session.add("--window", command.window, "S",
              "length of the window of the sliding variance [s] [default: 0.5]");
  session.add("--dwell", command.dwell, "S",
              "duration of a reading [s] [default: 1 to 20, computed from the noise]");
  session.add("--placement-u", command.placement_u, "RAD",
              "repeatability of a seat (standard deviation) [default: 3e-5]");
  session.add("--soak-window", command.soak_window, "S",
              "time for which the temperature must be steady before a block [s] [default: 300]");
  session.add("--soak-tolerance", command.soak_tolerance, "T",
              "largest change of the temperature output within --soak-window [default: 0.1]");
  session.add_flag("--free", command.free,
                   "without a cube: turn the instrument by hand until the readings cover all "
                   "directions (method 'magnitude')");
  session.add("--enough-deg", command.enough_deg, "U",
              "with --free: wanted expanded uncertainty (95 %) of any direction [degrees] "
              "[default: 0.5]");
  session.add_flag("--manual", command.manual, "take readings only on command, not automatically");
  session.add_flag("--unattended", command.unattended,
                   "at the end, repeat suspect readings, and finish the session without asking");
  OptionSet files = options.group("Files");
  files.add("--name", command.name, "NAME",
            "name of the files NAME.journal, .csv, .json, .html [default: axiscal-TIME]");
  files.add("--journal", command.journal, "FILE",
            "file for the journal of the session; it must not exist yet");
  files.add("--resume", command.resume, "JOURNAL", "continue a session that stopped");
  files.add_flag("--raw", command.raw, "store all samples in the journal");
  files.add("-o,--output", command.output, "FILE", "file for the readings (CSV)");
  files.add("--record", command.record, "FILE", "file for the calibration record (JSON)");
  files.add("--report", command.report, "FILE", "file for the report (HTML)");
  OptionSet health = options.group("Health");
  health.add(
      "--check", command.check, "RECORD",
      "test an installed instrument for drift, in any pose; exit status 1 if it has drifted");
  health.add("--readings", command.readings, "N",
             "number of readings at rest before the verdict [default: 3]");
  health.add("--within", command.within, "S",
             "end without a verdict after this time [s] [default: 60]");
  OptionSet face = options.group("User interface");
  face.add_flag("--plain", command.plain, "write lines of text; read commands from stdin");
  face.add_flag("--json", command.json, "write events as JSON lines; read commands from stdin");
  face.add_flag("--web", command.web, "show the session in a browser on this machine");
  face.add("--port", command.port, "N", "port of the page [default: 8712, or the next free one]");
  face.add("--listen", command.listen, "ADDRESS",
           "serve the page encrypted at this network address; a one-time key (QR code) gives "
           "access");
}

}  // namespace

AcquireCommand parse_acquire_command(const std::vector<std::string>& arguments,
                                     const std::string& path) {
  AcquireCommand command;
  const std::array<Subcommand, 1> acquire = {
      {{"acquire", "", "", [&command](OptionSet& options) -> Action {
          add_options(options, command);
          return [] { return 0; };
        }}}};
  if (arguments.empty() || arguments.front() != acquire.front().name) {
    throw DataError(path, "the journal's command is not `axiscal acquire`");
  }
  static_cast<void>(parse_command_line(arguments, acquire));
  return command;
}

Subcommand acquire_subcommand(int (*run)(const AcquireCommand&)) {
  return make_subcommand<AcquireCommand>("acquire", "record a live instrument, guided step by step",
                                         "", &add_options, run);
}

}  // namespace axiscal::cli
