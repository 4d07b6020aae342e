// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// What the first line of a session's journal says that it is: {"format": "axiscal-journal", ..}.
inline constexpr std::string_view journal_format = "axiscal-journal";

/// A file that only grows: one JSON object a line, on the disk before append() returns.
///
/// What was appended survives a crash, kill -9 and a full disk. A line that was not written whole
/// is cut off again, at once or when the journal is opened next.
class Journal {
 public:
  /// Starts a new journal.
  /// @throws OutputError  if the file is there already, or cannot be written.
  [[nodiscard]] static Journal create(const std::string& path);

  /// Opens one to go on with it; nobody else may.
  /// @param path   of the journal.
  /// @param lines  set to what it holds, without a last line that was not written whole.
  /// @throws DataError    if there is no such file, or its first line is not that of a journal; it
  ///                      is then left as it is.
  /// @throws OutputError  if it cannot be written, or another program has it open.
  [[nodiscard]] static Journal open(const std::string& path, std::vector<std::string>& lines);

  ~Journal();
  Journal(Journal&& other) noexcept;
  Journal& operator=(Journal&&) = delete;

  /// Appends a line and waits until the disk has it.
  ///
  /// @param line  without a line end.
  /// @return why it is not stored (disk full, ...); empty where it is. What was stored before is
  ///         still there, and the same line may be tried again.
  [[nodiscard]] std::string append(std::string_view line);

  /// As append(), but does not wait for the disk: for raw samples.
  [[nodiscard]] std::string append_later(std::string_view line);

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  Journal(std::string path, int descriptor, long long size);
  std::string write(std::string_view line, bool wait);

  std::string path_;
  int descriptor_;
  long long size_;  // how many bytes are whole
};

}  // namespace axiscal
