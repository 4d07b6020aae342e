// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

namespace axiscal {

/// A file, pipe or device opened for reading; the path `-` is standard input.
class InputFile {
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

 private:
  std::string path_;
  int descriptor_ = -1;
};

/// @return the whole content of a file; `-` is standard input.
/// @throws DataError  as InputFile.
[[nodiscard]] std::string read_whole_file(const std::string& path);

}  // namespace axiscal
