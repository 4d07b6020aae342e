// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// Reads a text line by line. The memory use does not depend on the length of the text.
class LineStream {
 public:
  explicit LineStream(ByteSource bytes) : bytes_(std::move(bytes)), buffer_(1U << 18U) {}

  /// @return the start of the text without consuming it; valid only before the first call of
  ///         next().
  [[nodiscard]] std::string_view peek(std::size_t size) { return bytes_.peek(size); }

  /// Reads the next line. `line` is without its line end, and valid until the next call.
  /// @return false at the end.
  /// @throws DataError  for a line of more than 1 MiB.
  bool next(std::string_view& line);

  /// @return the number of the last line that was read, from 1.
  [[nodiscard]] std::size_t line() const { return line_; }

  [[nodiscard]] const std::string& path() const { return bytes_.path(); }

 private:
  ByteSource bytes_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t filled_ = 0;
  bool at_end_ = false;
  std::size_t line_ = 0;
};

/// @param start     the start of a text.
/// @param is_whole  true if `start` is the whole text. Otherwise the last line may be cut off, and
///                  is left out unless it is the only line.
/// @param most      largest number of lines.
/// @return the first lines of the text, without line ends.
[[nodiscard]] std::vector<std::string_view> first_lines(std::string_view start,
                                                        bool is_whole,
                                                        std::size_t most = 200);

/// @return true if `is_such` is true for at least half of the first 20 lines of a text.
[[nodiscard]] bool are_most_lines(std::string_view start,
                                  const std::function<bool(std::string_view line)>& is_such);

/// @param convert  receives a line, and writes to `text` the text that replaces it, including a
///                 line end.
/// @return a source of the converted text.
[[nodiscard]] ByteSource converted_lines(
    ByteSource bytes, std::function<void(std::string_view line, std::string& text)> convert);

}  // namespace axiscal
