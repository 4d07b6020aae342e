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
  char delimiter = ',';  ///< a blank stands for any run of blanks and tabs
  bool decimal_comma = false;
  std::vector<std::string> columns;  ///< names; c1, c2, ... without a header
  bool has_header = false;
  std::size_t header_line = 0;     ///< counted from 1; 0 without a header
  std::size_t first_row_line = 1;  ///< counted from 1
  bool first_is_empty = false;     ///< each row begins with a delimiter: "| 1 | 2 |"
  bool last_is_empty = false;      ///< each row ends with a delimiter
  std::vector<bool> is_text;       ///< for each column true if it contains no number
  std::vector<bool> is_clock;      ///< for each column true if it has dates or times of day
  /// For each column true if its numbers have a unit or separated thousands; see
  /// parse_decorated_number().
  std::vector<bool> is_dressed;
  bool header_is_odd = false;      ///< its number of cells differs from the rows'
  double rate_hz = 0.0;            ///< from a line before the table, "Update Rate: 100.0Hz"; or 0
  std::vector<std::string> notes;  ///< notes on the layout

  /// @return the cells of a row, without the first and the last one if these are empty in all rows.
  [[nodiscard]] std::vector<std::string_view> cells_of_row(std::string_view line) const;
};

/// The number of first bytes of a text from which the layout is found.
inline constexpr std::size_t layout_bytes = 1U << 16U;

/// The start of a text: layout_bytes, or more if they contain less than a few rows of a wide table.
struct TextStart {
  std::string_view text;
  bool is_whole = false;
};

/// @param bytes  a ByteSource or a LineStream, read by peek().
template <typename Bytes>
[[nodiscard]] TextStart start_of_text(Bytes& bytes) {
  constexpr std::ptrdiff_t few = 4;
  constexpr std::size_t most = few << 20U;  // a few rows of the longest lines
  for (std::size_t size = layout_bytes;; size *= 2) {
    const std::string_view text = bytes.peek(size);
    if (text.size() < size || size >= most || std::count(text.begin(), text.end(), '\n') >= few) {
      return {.text = text, .is_whole = text.size() < size};
    }
  }
}

/// @param path   for messages.
/// @param start  the first bytes of the text, UTF-8.
/// @param names  names of columns without a header; may be empty.
/// @throws DataError  if the text is not a table; the message states the reason.
[[nodiscard]] TextLayout detect_text_layout(const std::string& path,
                                            std::string_view start,
                                            bool is_whole,
                                            const std::vector<std::string>& names);

/// @return seconds for a time of day, 14:08:06.818; seconds since 1970 for a date and time; NaN for
///         other texts.
[[nodiscard]] double clock_seconds(std::string_view cell);

}  // namespace axiscal
