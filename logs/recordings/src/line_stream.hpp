// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// A text, line by line, in constant memory.
class LineStream {
 public:
  explicit LineStream(ByteSource bytes) : bytes_(std::move(bytes)), buffer_(1U << 18U) {}

  /// @return the start of the text, which next() gives once more; before the first next() only.
  [[nodiscard]] std::string_view peek(std::size_t size) { return bytes_.peek(size); }

  /// Goes on to the next line, without its end; valid until the next call.
  /// @return false at the end.
  /// @throws DataError  for a line of more than 1 MiB.
  bool next(std::string_view& line);

  /// @return where the line last read stands, counted from 1.
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

/// @return the complete lines at the start of a text, without line ends. The last line may be cut;
///         it is included only if it is the only one.
[[nodiscard]] std::vector<std::string_view> first_lines(std::string_view start,
                                                        bool is_whole,
                                                        std::size_t most = 200);

/// @return whether half of the first lines of a text, or more, are such.
[[nodiscard]] bool are_most_lines(std::string_view start,
                                  const std::function<bool(std::string_view line)>& is_such);

/// @param convert  is given each line and makes what comes in its place, its end included.
/// @return a text in which each line is replaced.
[[nodiscard]] ByteSource converted_lines(
    ByteSource bytes, std::function<void(std::string_view line, std::string& text)> convert);

}  // namespace axiscal
