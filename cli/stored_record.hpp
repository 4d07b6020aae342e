// SPDX-License-Identifier: Apache-2.0
// The options --store, --serial, --at and --slot, which select a record in a store.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "option_set.hpp"

namespace axiscal {
class TemporaryFile;
}

namespace axiscal::cli {

/// The options that select a record in a store, with unparsed values.
struct StoredRecordOptions {
  std::optional<std::string> store, serial, at, slot;
};

void add_stored_record_options(OptionSet& options, StoredRecordOptions& record);

/// Copies the record that the options select from the store to a temporary file.
/// @return the file; null if --store is not given.
/// @throws UsageError  if --store is given without --serial, or if --serial, --at or --slot is
/// given without --store.
/// @throws DataError   if the store has no such record.
[[nodiscard]] std::unique_ptr<TemporaryFile> stored_record(const StoredRecordOptions& record);

}  // namespace axiscal::cli
