// SPDX-License-Identifier: Apache-2.0
#include "report_options.hpp"

#include "adjuster_options.hpp"
#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

void add_options(OptionSet& options, ReportCommand& command) {
  options.add("record", command.record, "RECORD",
              "calibration record (JSON); not with --fleet or --store");
  options.add("observations", command.observations, "OBS",
              "readings of the record (CSV), to show their values, times and directions");
  add_table_options(options, command.table);
  options.add(
      "--history", command.history, "FOLDER",
      "records of the same unit, to show its drift over the years: a folder, a .jsonl file or a "
      "store");
  options.add("--adjusters", command.adjusters, "X,Y;X,Y;..",
              "positions of the table's height adjusters [m], to show the turns that level the "
              "table");
  options.add("--thread-pitch", command.thread_pitch, "M", "thread pitch of the adjusters [m]");
  options.add("--positioner", command.positioner, "FILE",
              "positioner file with the table and its adjusters");
  options.add("--noise", command.noise, "FILE",
              "noise of the instrument at rest (from `noise --json`), to show its Allan deviation");
  options.add(
      "--laboratory", command.laboratory, "FILE",
      "file with details of a certificate: laboratory, customer, number, ... (axiscal-laboratory, "
      "JSON)");
  add_stored_record_options(options, command.stored);
  options.add("--fleet", command.fleet, "STORE",
              "a page about all units of a store (FILE.db or postgresql://..): yield, capability, "
              "control charts, retests and outliers");
  options.add("--kind", command.kind, "KIND", "with --fleet: only this kind of instrument");
  options.add("--model", command.model, "NAME", "with --fleet: only this model");
  options.add("--since", command.since, "DATE", "with --fleet: only tests from this date on");
  options.add("--until", command.until, "DATE", "with --fleet: only tests up to this date");
  options.add("--limits", command.limits, "FILE",
              "with --fleet: limits for the capability [default: those of the newest record]");
  options.add("-o,--output", command.output, "FILE", "a report (.html), or a certificate (.pdf)",
              Need::required);
  options.add_flag("--json", command.json,
                   "print JSON: the file, its kind, and the missing details");
}

}  // namespace

Subcommand report_subcommand(int (*run)(const ReportCommand&)) {
  return make_subcommand<ReportCommand>(
      "report", "write a report (HTML) or a certificate (PDF) of a calibration", "", &add_options,
      run);
}

}  // namespace axiscal::cli
