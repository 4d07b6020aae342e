// SPDX-License-Identifier: Apache-2.0
// Access to stores of calibrations through the program axiscal-store, the only program that links
// database libraries.
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

/// @return true if the text is the address of a store: `postgresql://..` or `FILE.db`.
[[nodiscard]] bool is_store(const std::string& text);

/// @return false if the store is a file that does not exist. A server is not contacted, so the
///         result for a server is always true.
[[nodiscard]] bool is_store_there(const std::string& store);

/// Writes records to a store as soon as they are made.
class StoreWriter {
 public:
  /// @throws RefusedError  if axiscal-store is not installed.
  explicit StoreWriter(const std::string& store);

  /// @param lines  one record per line, in the format that `axiscal store add -` reads.
  /// @throws OutputError  if axiscal-store has ended. It has then printed the reason.
  void write(std::string_view lines);

  /// Waits until all records are stored.
  /// @throws OutputError  if a record could not be stored.
  void finish();

 private:
  std::string store_;
  ChildProgram program_;
};

/// Runs `axiscal store ARGUMENTS..`.
/// @param arguments  action and options, without the option --store.
/// @return the output of the command.
/// @throws DataError  if the command fails. It has then printed the reason.
[[nodiscard]] std::string ask_store(const std::string& store,
                                    const std::vector<std::string>& arguments);

/// @return the records in a folder, in a file with one record per line (.jsonl, .jsonl.zst), or in
///         a store.
/// @param text  name of the folder, file or store.
/// @throws DataError  if there are no such records.
[[nodiscard]] RecordTexts named_records(const std::string& text);

/// @return the SHA-256 of the files, separated by blanks.
[[nodiscard]] std::string digests_of(const std::vector<InputFileDigest>& files);

/// @return a record as a line of input for `axiscal store add -`.
/// @param record  a record in one line, from in_one_line().
/// @param station, batch  origin of the record; may be empty.
[[nodiscard]] std::string stored_line(const std::string& record,
                                      const std::string& station,
                                      const std::string& batch);

/// @return the SHA-256 of a record without the time at which it was computed, so that calls with
///         the same readings and settings give the same digest.
/// @param record  a record in one line, from in_one_line().
[[nodiscard]] std::string record_digest(const std::string& record);

/// @return a JSON text without blanks and line ends, except in strings.
[[nodiscard]] std::string in_one_line(const std::string& json);

}  // namespace axiscal::cli
