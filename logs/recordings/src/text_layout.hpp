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
  char delimiter = ',';  ///< character between cells; ' ' means any number of blanks and tabs
  bool decimal_comma = false;
  std::vector<std::string> columns;  ///< names; c1, c2, ... if there is no header
  bool has_header = false;
  std::size_t header_line = 0;     ///< line number of the header, from 1; 0 if there is none
  std::size_t first_row_line = 1;  ///< line number of the first row, from 1
  bool first_is_empty = false;     ///< true if each row begins with a delimiter: "| 1 | 2 |"
  bool last_is_empty = false;      ///< true if each row ends with a delimiter: "1, 2,"
  std::vector<bool> is_text;       ///< true for each column that contains text and no numbers
  std::vector<bool> is_clock;      ///< true for each column of dates or times of day
  /// True for each column whose numbers are followed by a unit or contain thousands separators;
  /// see parse_decorated_number().
  std::vector<bool> is_dressed;
  bool header_is_odd = false;      ///< true if header and rows differ in their number of cells
  double rate_hz = 0.0;            ///< from a line such as "Update Rate: 100.0Hz"; 0 if not stated
  std::vector<std::string> notes;  ///< notes on the layout

  /// @return the cells of a row, without the first and the last one if these are empty in all rows.
  [[nodiscard]] std::vector<std::string_view> cells_of_row(std::string_view line) const;
};

/// Number of bytes at the start of a text from which the layout is found.
inline constexpr std::size_t layout_bytes = 1U << 16U;

/// The start of a text: its first layout_bytes, or more if these contain fewer than four line ends.
struct TextStart {
  std::string_view text;
  bool is_whole = false;
};

/// @param bytes  a ByteSource or a LineStream; its bytes are not consumed.
/// @return the start of the text.
template <typename Bytes>
[[nodiscard]] TextStart start_of_text(Bytes& bytes) {
  constexpr std::ptrdiff_t few = 4;
  constexpr std::size_t most = few << 20U;  // limit in bytes: room for four lines of 1 MiB
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

/// @param cell  a time of day such as 14:08:06.818, or a date and time.
/// @return the seconds since midnight for a time of day, or since 1970 for a date and time; NaN if
///         the text is neither.
[[nodiscard]] double clock_seconds(std::string_view cell);

}  // namespace axiscal
