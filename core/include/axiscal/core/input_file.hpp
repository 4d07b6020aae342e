// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The most that is read of a file that must be held whole: a record, an experiment, a journal's
/// line.
inline constexpr std::size_t largest_whole_file = 256U << 20U;

/// A line longer than this is an error: whatever it is, it is not text of readings.
inline constexpr std::size_t longest_line = 1U << 20U;

/// A file, pipe or device opened for reading; the path `-` is standard input.
class AXISCAL_EXPORT InputFile {
 public:
  /// @throws DataError  if the path does not exist, is a directory or cannot be read.
  explicit InputFile(std::string path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Reads what is there, at most `size` bytes; waits only while there is nothing yet.
  ///
  /// @return the number of bytes read; 0 at the end.
  /// @throws DataError  if reading fails.
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size);

  [[nodiscard]] const std::string& path() const { return path_; }

  /// @return of a regular file the bytes that it had when it was opened; else 0.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  std::string path_;
  std::size_t size_ = 0;
  int descriptor_ = -1;
};

/// @return true if a path names a file that can be read more than once. `-`, a pipe, a folder and
///         an empty path cannot.
[[nodiscard]] AXISCAL_EXPORT bool can_be_read_again(const std::string& path);

/// @return the whole content of a file; `-` is standard input.
/// @throws DataError  as InputFile; or if it is larger than largest_whole_file.
[[nodiscard]] AXISCAL_EXPORT std::string read_whole_file(const std::string& path);

/// Reads a text file line by line, in constant memory.
///
/// @param path  of the file.
/// @param take  is given each line without its end, and whether that end was there: of the last
///              line it may be missing.
/// @param longest  that a line may be [bytes].
/// @throws DataError  as InputFile; or if a line is longer.
AXISCAL_EXPORT void for_each_line(
    const std::string& path,
    const std::function<void(std::string_view line, bool is_whole)>& take,
    std::size_t longest = longest_line);

}  // namespace axiscal
