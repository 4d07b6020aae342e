// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal::cli {

/// @return the cells of a line of CSV, without its end; quotes that are doubled within a quoted
/// cell
///         are one.
[[nodiscard]] std::vector<std::string> cells_of(std::string_view line);

/// Converts CSV text into JSON Lines: one object per row, with the names of the header.
class JsonLines {
 public:
  /// @param csv  the next part of the text; the first line of all is the header.
  /// @return the rows that are complete. Numbers are numbers, empty cells and NaN are null, other
  ///         cells are texts.
  [[nodiscard]] std::string of(std::string_view csv);

 private:
  std::vector<std::string> names_;
  std::string rest_;  // a line that is not complete
};

}  // namespace axiscal::cli
