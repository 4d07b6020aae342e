// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The largest size of a file that is read completely into memory [bytes].
inline constexpr std::size_t largest_whole_file = 256U << 20U;

/// The largest length of a line [bytes]. A longer line is an error, because the file is probably
/// not a text of readings.
inline constexpr std::size_t longest_line = 1U << 20U;

/// A file, pipe or device opened for reading; the path `-` is standard input.
class AXISCAL_EXPORT InputFile {
 public:
  /// @throws DataError  if the path does not exist, is a directory or cannot be read.
  explicit InputFile(std::string path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Reads the available bytes, at most `size`. It waits only if no byte is available.
  ///
  /// @return the number of bytes read; 0 at the end.
  /// @throws DataError  if reading fails.
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size);

  [[nodiscard]] const std::string& path() const { return path_; }

  /// @return the size [bytes] of a regular file at the time when it was opened; 0 for a pipe or
  ///         device.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  std::string path_;
  std::size_t size_ = 0;
  int descriptor_ = -1;
};

/// @return true if the path is a regular file, which can be read more than once. `-`, a pipe, a
///         folder and an empty path give false.
[[nodiscard]] AXISCAL_EXPORT bool can_be_read_again(const std::string& path);

/// @return the whole content of a file; `-` is standard input.
/// @throws DataError  if the file cannot be read, or is larger than largest_whole_file.
[[nodiscard]] AXISCAL_EXPORT std::string read_whole_file(const std::string& path);

/// Reads a text file line by line. The memory use does not depend on the size of the file.
///
/// @param path     the file's path.
/// @param take     receives each line without its line end. `is_whole` is false if the line end is
///                 missing, which is possible only in the last line.
/// @param longest  the largest length of a line [bytes].
/// @throws DataError  if the file cannot be read, or a line is longer than `longest`.
AXISCAL_EXPORT void for_each_line(
    const std::string& path,
    const std::function<void(std::string_view line, bool is_whole)>& take,
    std::size_t longest = longest_line);

}  // namespace axiscal
