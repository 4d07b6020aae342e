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
  bool last_is_empty = false;      ///< each row ends with a delimiter: "1, 2,"
  std::vector<bool> is_text;       ///< true for each column that contains text and no numbers
  std::vector<bool> is_clock;      ///< true for each column of dates or times of day
  /// True for each column whose numbers have a unit or separated thousands; see
  /// parse_decorated_number().
  std::vector<bool> is_dressed;
  bool header_is_odd = false;      ///< true if header and rows differ in their number of cells
  double rate_hz = 0.0;            ///< stated before the table, "Update Rate: 100.0Hz"; or 0
  std::vector<std::string> notes;  ///< notes on the layout

  /// @return the cells of a row, without the first and the last one if these are empty in all rows.
  [[nodiscard]] std::vector<std::string_view> cells_of_row(std::string_view line) const;
};

/// The number of first bytes of a text from which the layout is found.
inline constexpr std::size_t layout_bytes = 1U << 16U;

/// The first layout_bytes of a text, or more bytes if these contain fewer than four line ends.
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

/// @param path      path of the text, for messages.
/// @param start     the first bytes of the text, UTF-8.
/// @param is_whole  true if `start` is the whole text.
/// @param names     names of the columns if there is no header; may be empty.
/// @throws DataError  if the text is not a table; the message states the reason.
[[nodiscard]] TextLayout detect_text_layout(const std::string& path,
                                            std::string_view start,
                                            bool is_whole,
                                            const std::vector<std::string>& names);

/// @return seconds for a time of day, 14:08:06.818; seconds since 1970 for a date and time; NaN for
///         other texts.
[[nodiscard]] double clock_seconds(std::string_view cell);

}  // namespace axiscal
