// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/text_row.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/line_stream.hpp"
#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/text_encoding.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

constexpr const char* unknown_format_words =
    "is neither text nor a file of another known format; the known formats are tables (text, .npy, "
    ".mat, .xlsx, JSON), flight logs (ULog, DataFlash, tlog, blackbox), bags (ROS 1, ROS 2, MCAP), "
    "recordings of phones";

// Reads a decimal number without an exponent whose digits, as an integer, are at most 2^53. Nearly
// all numbers in a log are of this form. The result is correctly rounded, because the integer and
// the power of ten are exact doubles (W. D. Clinger, PLDI 1990).
// @return the end of the number; null if it has another form and must be read by from_chars().
const char* read_plain_number(const char* at, const char* end, double& value) {
  constexpr std::array<double, 23> powers = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                             1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                             1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const bool negative = at < end && *at == '-';
  at += negative ? 1 : 0;
  const char* const first = at;
  std::uint64_t digits = 0;
  const auto read_digits = [&] {
    while (at < end && static_cast<unsigned char>(*at - '0') < 10) {
      digits = 10 * digits + static_cast<std::uint64_t>(*at++ - '0');
    }
  };
  read_digits();
  const char* point = at;
  const bool has_point = at < end && *at == '.';
  if (has_point) {
    ++at;
    read_digits();
  } else {
    point = at - 1;
  }
  const auto decimals = static_cast<std::size_t>(at - point - 1);
  const bool has_exponent = at < end && (*at == 'e' || *at == 'E');
  constexpr std::uint64_t exact = 1ULL << 53U;
  const std::ptrdiff_t longest = has_point ? 20 : 19;  // 19 digits do not overflow
  if (has_exponent || at - first > longest || at - first < 1 || digits > exact ||
      decimals >= powers.size() || (at - first == 1 && *first == '.')) {
    return nullptr;
  }
  value = static_cast<double>(digits) / powers[decimals];
  value = negative ? -value : value;
  return at;
}

class TextLog : public LogFile::Source {
 public:
  TextLog(ByteSource bytes, const std::vector<std::string>& names)
      : lines_(as_utf8(std::move(bytes))) {
    read_start(names);
    std::vector<std::size_t> all(columns.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i] = i;
    }
    select(all);
  }

  void select(const std::vector<std::size_t>& selected) override {
    place_.assign(columns.size(), -1);
    for (std::size_t i = 0; i < selected.size(); ++i) {
      place_[selected[i]] = static_cast<int>(i);
    }
    selected_ = selected.size();
  }

  std::size_t read(LogBlock& block, std::size_t most) override {
    block.resize(selected_);
    for (std::vector<double>& column : block) {
      column.resize(most);
    }
    std::size_t rows = 0;
    std::string_view line;
    while (rows < most && lines_.next(line)) {
      if (is_row(line) && parse(line, block, rows)) {
        ++rows;
      }
    }
    for (std::vector<double>& column : block) {
      column.resize(rows);
    }
    if (rows == 0 && rows_ == 0) {
      throw DataError(lines_.path(), lines_.line(),
                      "no rows of numbers were found; do the later rows have another separator "
                      "than the first rows?");
    }
    if (rows == 0 && erased_rows_ > 0) {
      notes.push_back(
          formatted("{} rows (the first is line {}) are left out, because they contain erased "
                    "memory or no numbers",
                    erased_rows_, first_erased_line_));
      erased_rows_ = 0;
    }
    rows_ += rows;
    return rows;
  }

 private:
  // Finds the layout of the text from its start.
  void read_start(const std::vector<std::string>& names) {
    const auto [start, is_whole] = start_of_text(lines_);
    if (start.empty()) {
      throw DataError(lines_.path(), "the file is empty");
    }
    if (start.find('\0') != std::string_view::npos) {
      throw DataError(lines_.path(), unknown_format_words);
    }
    constexpr std::size_t lines_ahead = 200;
    layout_ = detect_text_layout(lines_.path(), start, is_whole, names);
    if (layout_.has_header && layout_.header_line <= lines_ahead) {
      header_ = without_checksum(first_lines(start, is_whole)[layout_.header_line - 1]);
    }
    notes = layout_.notes;
    columns = layout_.columns;
    rate_hz = layout_.rate_hz;
    for (std::size_t c = columns.size(); c-- > 0;) {
      if (layout_.is_clock[c]) {
        clock = c;
      }
    }
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (layout_.is_text[c]) {
        is_text.push_back(c);
      }
    }
    is_plain_ = layout_.delimiter != ' ' && !layout_.decimal_comma && !layout_.first_is_empty &&
                !layout_.last_is_empty &&
                std::none_of(layout_.is_clock.begin(), layout_.is_clock.end(),
                             [](bool is_clock) { return is_clock; }) &&
                std::none_of(layout_.is_dressed.begin(), layout_.is_dressed.end(),
                             [](bool is_dressed) { return is_dressed; });
  }

  bool is_row(std::string_view line) const {
    return lines_.line() >= layout_.first_row_line && !line.empty() && line.front() != '#' &&
           line.front() != '%' && !line.starts_with("//") &&
           line.find_first_not_of(" \t\r") != std::string_view::npos;
  }

  // Reads the numbers of a line into a row of the block.
  // @return false if the line is left out, because it repeats the header, contains no readings, or
  //         has a wrong number of cells.
  bool parse(std::string_view line, LogBlock& block, std::size_t row) {
    line = without_checksum(line);
    if (layout_.has_header && line == header_) {
      return false;  // the logger was restarted, and wrote its header again
    }
    if (is_erased(line)) {
      first_erased_line_ = erased_rows_++ == 0 ? lines_.line() : first_erased_line_;
      return false;
    }
    const bool good = is_plain_ && line.find('"') == std::string_view::npos
                          ? parse_quickly(line, block, row)
                          : parse_slowly(line, block, row);
    has_readings_ = has_readings_ || good;
    if (!good) {
      if (defects.ragged_rows++ == 0) {
        defects.first_ragged_line = lines_.line();
      }
    }
    return good;
  }

  // True if a row contains no readings. This is so in three cases: no cell is a number; all cells
  // are the same number from erased memory, whose bits are all 1 (-1 if signed); or all cells are
  // 0, and a row with readings came before.
  [[nodiscard]] bool is_erased(std::string_view line) const {
    constexpr std::size_t fewest = 4;  // fewer columns may be equal by chance
    const auto has_one_of = [&](std::string_view digits) {
      return line.find_first_of(digits) != std::string_view::npos;
    };
    const bool may_be = line.starts_with("4294967") || line.starts_with("65535") ||
                        (line.starts_with("-1") && !has_one_of("23456789")) ||
                        !has_one_of("123456789");
    if (columns.size() < fewest || !may_be) {
      return false;
    }
    constexpr std::array<double, 6> erased = {4294967295.0, 4294967.295, 4294967.0,
                                              65535.0,      -1.0,        0.0};
    const std::vector<std::string_view> cells = layout_.cells_of_row(line);
    const double first = cells.empty() ? 0.0 : cell_number(cells.front(), layout_.decimal_comma);
    const bool is_known = std::find(erased.begin(), erased.end(), first) != erased.end() &&
                          (first != 0.0 || has_readings_);
    return (is_known || std::isnan(first)) &&
           std::all_of(cells.begin(), cells.end(), [&](std::string_view cell) {
             const double value = cell_number(cell, layout_.decimal_comma);
             return value == first || (std::isnan(first) && std::isnan(value));
           });
  }

  void put(LogBlock& block, std::size_t column, std::size_t row, double value) {
    if (place_[column] >= 0) {
      block[static_cast<std::size_t>(place_[column])][row] = value;
      if (!std::isfinite(value) && defects.missing_numbers++ == 0) {
        defects.first_missing_line = lines_.line();
      }
    }
  }

  bool parse_quickly(std::string_view line, LogBlock& block, std::size_t row) {
    const char* at = line.data();
    const char* const end = at + line.size();
    for (std::size_t column = 0; column < columns.size(); ++column) {
      const char* cell_end = end;
      if (place_[column] >= 0) {
        while (at < end && *at == ' ') {
          ++at;
        }
        double value = 0.0;
        const char* stop = read_plain_number(at, end, value);
        bool is_number = stop != nullptr;
        if (!is_number) {
          const auto [after, error] = std::from_chars(at, end, value);
          stop = after;
          is_number = error == std::errc{} && std::isfinite(value);
        }
        if (is_number && (stop == end || *stop == layout_.delimiter)) {
          cell_end = stop;
        } else {
          const void* const found =
              std::memchr(at, layout_.delimiter, static_cast<std::size_t>(end - at));
          cell_end = found != nullptr ? static_cast<const char*>(found) : end;
          value = cell_number(trimmed({at, static_cast<std::size_t>(cell_end - at)}), false);
        }
        put(block, column, row, value);
      } else {
        const void* const found =
            std::memchr(at, layout_.delimiter, static_cast<std::size_t>(end - at));
        cell_end = found != nullptr ? static_cast<const char*>(found) : end;
      }
      const bool last = column + 1 == columns.size();
      if (last || cell_end == end) {
        return last && cell_end == end;
      }
      at = cell_end + 1;
    }
    return false;
  }

  // Makes times of day continuous over midnight by adding whole days.
  double past_midnight(double time_s) {
    constexpr double day_s = 86400.0;
    if (time_s < day_s) {
      if (time_s + 0.5 * day_s < last_of_day_s_) {
        days_s_ += day_s;
      }
      last_of_day_s_ = std::isfinite(time_s) ? time_s : last_of_day_s_;
    }
    return time_s + days_s_;
  }

  bool parse_slowly(std::string_view line, LogBlock& block, std::size_t row) {
    const std::vector<std::string_view> cells = layout_.cells_of_row(line);
    if (cells.size() != columns.size()) {
      return false;
    }
    for (std::size_t column = 0; column < cells.size(); ++column) {
      if (place_[column] >= 0) {
        put(block, column, row,
            layout_.is_clock[column] ? past_midnight(clock_seconds(cells[column]))
            : layout_.is_dressed[column]
                ? parse_decorated_number(cells[column], layout_.decimal_comma).value
                : cell_number(cells[column], layout_.decimal_comma));
      }
    }
    return true;
  }

  LineStream lines_;
  std::string header_;  // line of the header; empty if there is no header
  TextLayout layout_;
  double days_s_ = 0.0, last_of_day_s_ = 0.0;
  bool is_plain_ = true;  // true if parse_quickly() can read the rows
  std::size_t rows_ = 0;
  std::size_t erased_rows_ = 0, first_erased_line_ = 0;
  bool has_readings_ = false;
  std::vector<int> place_;  // index of each column in a block; -1 if not selected
  std::size_t selected_ = 0;
};

}  // namespace

std::unique_ptr<LogFile::Source> open_text_log(ByteSource bytes,
                                               const std::vector<std::string>& names) {
  return std::make_unique<TextLog>(std::move(bytes), names);
}

}  // namespace axiscal
