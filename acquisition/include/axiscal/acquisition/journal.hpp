// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// The value of "format" in the first line of a session's journal.
inline constexpr std::string_view journal_format = "axiscal-journal";

/// An append-only file with one JSON object per line. append() returns only after the line is
/// stored on the disk.
///
/// Appended entries survive a crash, kill -9 and a full disk. After a failed write, the incomplete
/// last line is removed immediately, or when the journal is opened again.
class Journal {
 public:
  /// Starts a new journal.
  /// @throws OutputError  if the file exists already, or cannot be written.
  [[nodiscard]] static Journal create(const std::string& path);

  /// Opens an existing journal for appending, and locks it against other programs.
  /// @param path   the journal's file name.
  /// @param lines  receives all complete lines of the journal.
  /// @throws DataError    if the file does not exist, or its first line is not the header of a
  ///                      journal. The file stays unchanged.
  /// @throws OutputError  if the file cannot be written, or another program has locked it.
  [[nodiscard]] static Journal open(const std::string& path, std::vector<std::string>& lines);

  ~Journal();
  Journal(Journal&& other) noexcept;
  Journal& operator=(Journal&&) = delete;

  /// Appends a line and waits until it is on the disk.
  ///
  /// @param line  a line without a line feed.
  /// @return empty on success; otherwise the reason (disk full, ...). A failure does not affect
  ///         earlier lines, and the caller may append the line again.
  [[nodiscard]] std::string append(std::string_view line);

  /// Appends a line of raw samples without waiting until the line is on the disk.
  [[nodiscard]] std::string append_without_sync(std::string_view line);

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  Journal(std::string path, int descriptor, long long size);
  std::string write(std::string_view line, bool wait);

  std::string path_;
  int descriptor_;
  long long size_;  // number of bytes in complete lines
};

}  // namespace axiscal
