// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// The content of the first line of a session's journal: {"format": "axiscal-journal", ..}.
inline constexpr std::string_view journal_format = "axiscal-journal";

/// A file that only grows: one JSON object a line, on the disk before append() returns.
///
/// Appended entries survive a crash, kill -9 and a full disk. An incomplete last line is cut off,
/// at once or when the journal is opened the next time.
class Journal {
 public:
  /// Starts a new journal.
  /// @throws OutputError  if the file is there already, or cannot be written.
  [[nodiscard]] static Journal create(const std::string& path);

  /// Opens an existing journal for appending, with a lock.
  /// @param path   of the journal.
  /// @param lines  receives the content without an incomplete last line.
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
  /// @return the reason if the line is not stored (disk full, ...); empty if it is. Earlier lines
  ///         stay stored, and the line may be tried again.
  [[nodiscard]] std::string append(std::string_view line);

  /// As append(), but does not wait for the disk: for raw samples.
  [[nodiscard]] std::string append_later(std::string_view line);

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  Journal(std::string path, int descriptor, long long size);
  std::string write(std::string_view line, bool wait);

  std::string path_;
  int descriptor_;
  long long size_;  // number of bytes in complete lines
};

}  // namespace axiscal
