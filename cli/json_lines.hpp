// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal::cli {

/// @return the cells of a line of CSV. Two double quotes in a quoted cell become one quote.
/// @param line  the line, without its line end.
[[nodiscard]] std::vector<std::string> cells_of(std::string_view line);

/// Converts CSV text to JSON Lines. Each row becomes an object whose keys are the names in the
/// header.
class JsonLines {
 public:
  /// @param csv  the next part of the text. The first line of the whole text is the header.
  /// @return JSON lines for the complete rows. Numbers become JSON numbers, empty cells and NaN
  ///         become null, and other cells become strings.
  [[nodiscard]] std::string of(std::string_view csv);

 private:
  std::vector<std::string> names_;
  std::string rest_;  // an incomplete line, which the next call continues
};

}  // namespace axiscal::cli
