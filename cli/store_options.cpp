// SPDX-License-Identifier: Apache-2.0
#include "store_options.hpp"

#include "subcommands.hpp"

namespace axiscal::cli {
namespace {

void add_options(OptionSet& options, StoreCommand& command) {
  options.add("action", command.action, "ACTION",
              "add: store records. list: print one row per record. show: print the record of a "
              "unit. export: write all records. verify: check all records. migrate: update the "
              "schema",
              Need::required);
  options.add("files", command.files, "FILE",
              "with 'add': records (.json, .jsonl, .jsonl.zst), a folder of records, or - for "
              "lines of stdin");
  options.add("--store", command.store, "STORE",
              "file of SQLite (.db), or postgresql://USER@HOST/DATABASE", Need::required);
  options.add("--serial", command.serial, "NAME", "only this unit; required with 'show'");
  options.add(
      "--at", command.at, "DATE",
      "with 'show': the calibration that was valid at this time (ISO 8601) [default: the newest]");
  options.add("--kind", command.kind, "KIND", "only this kind of instrument");
  options.add("--slot", command.slot, "NAME", "only this slot");
  options.add("--model", command.model, "NAME", "only this model");
  options.add("--status", command.status, "STATUS", "only ok, warning, refused or error");
  options.add("--since", command.since, "DATE", "only calibrations from this date on (ISO 8601)");
  options.add("--until", command.until, "DATE", "only calibrations up to and including this date");
  options.add("--station", command.station, "NAME",
              "only this station; with 'add': the station of the records");
  options.add("--operator", command.operated_by, "NAME", "only this operator");
  options.add("--batch", command.batch, "NAME",
              "only this batch; with 'add': the batch of the records");
  options.add_flag("--yield", command.yield,
                   "with 'list': print how many calibrations passed, and why others failed");
  options.add_flag("--json", command.json, "print JSON");
  options.add_output(command.output,
                     "output of 'show', 'list' and 'export': .json, .csv, .jsonl, .jsonl.zst, or a "
                     "folder with one file per record; - is stdout [default: -]");
}

}  // namespace

Subcommand store_subcommand(int (*run)(const StoreCommand&)) {
  return make_subcommand<StoreCommand>("store", "keep calibrations in a database", "", &add_options,
                                       run);
}

}  // namespace axiscal::cli
