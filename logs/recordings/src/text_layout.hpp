// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// The layout of a table of text, found from its first lines.
struct TextLayout {
  char delimiter = ',';  ///< ' ': any run of blanks and tabs
  bool decimal_comma = false;
  std::vector<std::string> columns;  ///< c1, c2, ... without a header
  bool has_header = false;
  std::size_t header_line = 0;     ///< counted from 1; 0 without one
  std::size_t first_row_line = 1;  ///< counted from 1
  bool first_is_empty = false;     ///< each row begins with a delimiter: "| 1 | 2 |"
  bool last_is_empty = false;      ///< each row ends with one
  std::vector<bool> is_text;       ///< columns in which no number stands
  std::vector<bool> is_clock;      ///< columns of dates or times of day
  /// Columns whose numbers have a unit behind them or parted thousands: dressed_number().
  std::vector<bool> is_dressed;
  bool header_is_odd = false;      ///< it has another number of cells than the rows
  double rate_hz = 0.0;            ///< as a line before the table states it: "Update Rate: 100.0Hz"
  std::vector<std::string> notes;  ///< notes for the reader

  /// @return the cells of a row, without those that are always empty at its ends.
  [[nodiscard]] std::vector<std::string_view> cells_of_row(std::string_view line) const;
};

/// The inputs for finding a table's layout.
inline constexpr std::size_t layout_bytes = 1U << 16U;

/// The start of a text: layout_bytes, or more where these hold less than a few rows of a wide
/// table.
struct TextStart {
  std::string_view text;
  bool is_whole = false;
};

/// @param bytes  which can be looked at before they are read: peek().
template <typename Bytes>
[[nodiscard]] TextStart start_of_text(Bytes& bytes) {
  constexpr std::ptrdiff_t few = 4;
  constexpr std::size_t most = few << 20U;  // of the longest rows
  for (std::size_t size = layout_bytes;; size *= 2) {
    const std::string_view text = bytes.peek(size);
    if (text.size() < size || size >= most || std::count(text.begin(), text.end(), '\n') >= few) {
      return {.text = text, .is_whole = text.size() < size};
    }
  }
}

/// @param path   for messages.
/// @param start  the first bytes of the text, UTF-8.
/// @param names  for columns without a header; may be empty.
/// @throws DataError  if the text is not a table; the message describes the text.
[[nodiscard]] TextLayout detect_text_layout(const std::string& path,
                                            std::string_view start,
                                            bool is_whole,
                                            const std::vector<std::string>& names);

/// @return seconds for a time of day, 14:08:06.818; seconds since 1970 for a date and time; NaN for
///         other texts.
[[nodiscard]] double clock_seconds(std::string_view cell);

}  // namespace axiscal
