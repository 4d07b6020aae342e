// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal::cli {

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
