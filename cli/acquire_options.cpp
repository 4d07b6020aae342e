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
              "instrument, field, cube and method (.json)");
  OptionSet source = options.group("Source");
  source.add(
      "--connect", command.sources, "ADDRESS",
      "address of the instrument; --list shows the kinds. Of several the first sets the pace");
  source.add_flag("--list", command.list, "list connected devices and the kinds of sources");
  source.add("--temperature-column", command.temperature_column, "NAME",
             "channel of the temperature [default: temperature]");
  add_experiment_options(options, command.experiment);
  add_sheet_options(options, command.sheet);
  OptionSet session = options.group("Session");
  session.add("--plan", command.plan, "SHEET", "run sheet to follow, instead of a design");
  session.add("--noise", command.noise, "SD|FILE",
              "standard deviation of a sample at rest, or the output of `noise --json`: sets the "
              "threshold for stillness and the dwell time [default: learned]");
  session.add("--window", command.window, "S", "window of the sliding variance [s] [default: 0.5]");
  session.add("--dwell", command.dwell, "S",
              "duration of a reading [default: by the noise, 1 to 20]");
  session.add("--placement-u", command.placement_u, "RAD",
              "repeatability of a seat (standard deviation) [default: 3e-5]");
  session.add("--soak-window", command.soak_window, "S",
              "time for which the temperature must be steady before a block [default: 300]");
  session.add("--soak-tolerance", command.soak_tolerance, "T",
              "largest change of the temperature output meanwhile [default: 0.1]");
  session.add_flag(
      "--free", command.free,
      "no cube: turn the instrument by hand until all directions are filled (method magnitude)");
  session.add("--enough-deg", command.enough_deg, "U",
              "with --free: wanted expanded uncertainty of any direction (95 %) [default: 0.5]");
  session.add_flag("--manual", command.manual, "take readings on command, not by themselves");
  session.add_flag("--unattended", command.unattended,
                   "ask for suspect readings again at the end, then end the session");
  OptionSet files = options.group("Files");
  files.add("--name", command.name, "NAME",
            "name of the files NAME.journal, .csv, .json, .html [default: axiscal-TIME]");
  files.add("--journal", command.journal, "FILE", "journal file, a new file that only grows");
  files.add("--resume", command.resume, "JOURNAL", "continue a session that stopped");
  files.add_flag("--raw", command.raw, "keep every sample in the journal");
  files.add("-o,--output", command.output, "FILE", "the readings (CSV)");
  files.add("--record", command.record, "FILE", "the calibration record");
  files.add("--report", command.report, "FILE", "the report (HTML)");
  OptionSet health = options.group("Health");
  health.add(
      "--check", command.check, "RECORD",
      "test an installed instrument for drift, in any pose; exit status 1 if it has drifted");
  health.add("--readings", command.readings, "N",
             "readings at rest before the verdict [default: 3]");
  health.add("--within", command.within, "S", "give up after this time [default: 60]");
  OptionSet face = options.group("Face");
  face.add_flag("--plain", command.plain, "write lines of text; read commands from stdin");
  face.add_flag("--json", command.json, "events as JSON lines, commands on stdin");
  face.add_flag("--web", command.web, "show the session in the browser, on loopback");
  face.add("--port", command.port, "N", "port of the page [default: 8712, or the next free one]");
  face.add("--listen", command.listen, "ADDRESS",
           "serve the page at this address, encrypted, by one-time keys (QR code)");
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
    throw DataError(path, "its arguments are no `axiscal acquire`");
  }
  static_cast<void>(parse_command_line(arguments, acquire));
  return command;
}

Subcommand acquire_subcommand(int (*run)(const AcquireCommand&)) {
  return make_subcommand<AcquireCommand>("acquire", "record a live instrument, guided step by step",
                                         "", &add_options, run);
}

}  // namespace axiscal::cli
