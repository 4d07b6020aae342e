// SPDX-License-Identifier: Apache-2.0
// Stores, by the program axiscal-store: it alone links the databases.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/history.hpp"
#include "core/child_program.hpp"

namespace axiscal::cli {

inline constexpr OwnProgram store_program{.name = "axiscal-store", .package = "axiscal-store"};

/// @return true if the text is the address of a store: postgresql://.., or FILE.db.
[[nodiscard]] bool is_store(const std::string& text);

/// @return false if the store is a file that does not exist.
[[nodiscard]] bool is_store_there(const std::string& store);

/// Writes records to a store while they are made.
class StoreWriter {
 public:
  /// @throws RefusedError  if axiscal-store is not installed.
  explicit StoreWriter(const std::string& store);

  /// @param lines  records in one line each, as `axiscal store add -` reads them.
  /// @throws OutputError  if axiscal-store has ended; it has printed why.
  void write(std::string_view lines);

  /// Waits until all records are in the store.
  /// @throws OutputError  if they are not.
  void finish();

 private:
  std::string store_;
  ChildProgram program_;
};

/// @param arguments  of `axiscal store`: the action and its options, without --store.
/// @return its output.
/// @throws DataError  if it fails; it has printed why.
[[nodiscard]] std::string ask_store(const std::string& store,
                                    const std::vector<std::string>& arguments);

/// @return the records that an option names: of a folder, of a file of lines (.jsonl, .jsonl.zst),
///         or of a store.
/// @throws DataError  if there are no such records.
[[nodiscard]] RecordTexts named_records(const std::string& text);

/// @return a record as it is stored: a line of a file of records.
/// @param station, batch  empty if they are not stated.
[[nodiscard]] std::string stored_line(const std::string& record,
                                      const std::string& station,
                                      const std::string& batch);

/// @return JSON without the blanks and line ends between its parts.
[[nodiscard]] std::string in_one_line(const std::string& json);

}  // namespace axiscal::cli
