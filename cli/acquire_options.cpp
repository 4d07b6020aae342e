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
  source.add("--connect", command.sources, "ADDRESS",
             "where samples come from; several: the first sets the pace; --list shows kinds");
  source.add_flag("--list", command.list, "list connected devices and the kinds of sources");
  source.add("--temperature-column", command.temperature_column, "NAME",
             "channel of the temperature; temperature");
  add_experiment_options(options, command.experiment);
  add_sheet_options(options, command.sheet);
  OptionSet session = options.group("Session");
  session.add("--plan", command.plan, "SHEET", "run sheet, instead of a design");
  session.add("--noise", command.noise, "SD|FILE",
              "standard deviation of a sample at rest, or the output of `noise --json`: sets the "
              "threshold for stillness and the dwell time; learned by default");
  session.add("--window", command.window, "S", "of the sliding variance; 0.5");
  session.add("--dwell", command.dwell, "S", "how long a reading is taken; by the noise, 1 to 20");
  session.add("--placement-u", command.placement_u, "RAD",
              "repeatability of a seat (standard deviation); 3e-5");
  session.add("--soak-window", command.soak_window, "S",
              "the temperature is steady over it before a block; 300");
  session.add("--soak-tolerance", command.soak_tolerance, "T",
              "largest change of the temperature output meanwhile; 0.1");
  session.add_flag(
      "--free", command.free,
      "no cube: turned in the hand until the directions are filled (method magnitude)");
  session.add("--enough-deg", command.enough_deg, "U",
              "with --free: of any direction, expanded (95 %); 0.5");
  session.add_flag("--manual", command.manual, "take readings on command, not by themselves");
  session.add_flag(
      "--unattended", command.unattended,
      "unattended: suspect readings are asked for again at the end, then the session ends");
  OptionSet files = options.group("Files");
  files.add("--name", command.name, "NAME",
            "of the files: NAME.journal, .csv, .json, .html; axiscal-TIME");
  files.add("--journal", command.journal, "FILE", "a new file that only grows");
  files.add("--resume", command.resume, "JOURNAL", "go on where a session stopped");
  files.add_flag("--raw", command.raw, "keep every sample in the journal");
  files.add("-o,--output", command.output, "FILE", "the readings (CSV)");
  files.add("--record", command.record, "FILE", "the calibration record");
  files.add("--report", command.report, "FILE", "the report (HTML)");
  OptionSet health = options.group("Health");
  health.add("--check", command.check, "RECORD",
             "an installed instrument, in whatever pose it is: has it drifted? Exit status 1");
  health.add("--readings", command.readings, "N", "at rest, until the verdict; 3");
  health.add("--within", command.within, "S", "give up after this time; 60");
  OptionSet face = options.group("Face");
  face.add_flag("--plain", command.plain, "lines of words, commands as words on stdin");
  face.add_flag("--json", command.json, "events as JSON lines, commands on stdin");
  face.add_flag("--web", command.web, "a page for the browser, on loopback");
  face.add("--port", command.port, "N", "of the page; 8712, or the next free one");
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
  return make_subcommand<AcquireCommand>("acquire", "a live instrument -> observations, guided", "",
                                         &add_options, run);
}

}  // namespace axiscal::cli
