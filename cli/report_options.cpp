// SPDX-License-Identifier: Apache-2.0
#include "report_options.hpp"

#include "adjuster_options.hpp"
#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

void add_options(OptionSet& options, ReportCommand& command) {
  options.add("record", command.record, "RECORD", "calibration record (JSON)", Need::required);
  options.add("observations", command.observations, "OBS",
              "its readings (CSV), for their values, times and directions");
  add_table_options(options, command.table);
  options.add("--history", command.history, "FOLDER",
              "records of the same unit: its drift over the years");
  options.add("--adjusters", command.adjusters, "X,Y;X,Y;..",
              "where the table's height adjusters stand [m]: the turns that level it");
  options.add("--thread-pitch", command.thread_pitch, "M", "of the adjusters");
  options.add("--positioner", command.positioner, "FILE", "with a table and its adjusters");
  options.add("--noise", command.noise, "FILE",
              "of the instrument at rest (noise --json): its Allan deviation");
  options.add("--laboratory", command.laboratory, "FILE",
              "of a certificate: laboratory, customer, number, ... (axiscal-laboratory, JSON)");
  options.add("-o,--output", command.output, "FILE", "a report (.html), or a certificate (.pdf)",
              Need::required);
}

}  // namespace

Subcommand report_subcommand(int (*run)(const ReportCommand&)) {
  return make_subcommand<ReportCommand>("report", "calibration record -> a report to look at", "",
                                        &add_options, run);
}

}  // namespace axiscal::cli
