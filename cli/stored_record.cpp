// SPDX-License-Identifier: Apache-2.0
#include "stored_record.hpp"

#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "core/descriptor.hpp"
#include "core/temporary_file.hpp"
#include "store_client.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {

void add_stored_record_options(OptionSet& options, StoredRecordOptions& record) {
  options.add("--store", record.store, "STORE",
              "take the record from a database: FILE.db, or postgresql://USER@HOST/DATABASE");
  options.add("--serial", record.serial, "NAME", "with --store: serial number of the unit");
  options.add("--at", record.at, "DATE",
              "with --store: the record that was valid at this time (ISO 8601) [default: the "
              "newest]");
  options.add("--slot", record.slot, "NAME", "with --store: slot, if the unit has several");
}

std::unique_ptr<TemporaryFile> stored_record(const StoredRecordOptions& record) {
  if (!record.store) {
    if (record.serial || record.at || record.slot) {
      throw UsageError("--serial, --at, --slot: require --store");
    }
    return nullptr;
  }
  if (!record.serial) {
    throw UsageError("--store: requires --serial NAME, to select the unit");
  }
  std::vector<std::string> arguments = {"show", "--serial", *record.serial};
  for (const auto& [name, value] : {std::pair("--at", record.at), {"--slot", record.slot}}) {
    if (value) {
      arguments.insert(arguments.end(), {name, *value});
    }
  }
  auto file = std::make_unique<TemporaryFile>();
  if (!write_all(file->descriptor(), ask_store(*record.store, arguments))) {
    throw OutputError("the folder for temporary files is full");
  }
  return file;
}

}  // namespace axiscal::cli
