// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <utility>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/text_row.hpp"
#include "log_source.hpp"

namespace axiscal {
namespace {

constexpr std::size_t longest_row = 1U << 20U;

struct Dialect {
  char delimiter = ',';  // ' ': any run of blanks and tabs
  bool decimal_comma = false;
};

// Reads a plain decimal number, as nearly all of a log are: up to 19 digits, a point, a small
// exponent of ten by the point alone. Exact, as both the digits and the power of ten are exact
// doubles (W. D. Clinger, PLDI 1990).
// @return the end of the number; null where it is not so plain, and from_chars has to do.
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
  if (at < end && *at == '.') {
    ++at;
    read_digits();
  } else {
    point = at - 1;
  }
  const auto decimals = static_cast<std::size_t>(at - point - 1);
  const bool has_exponent = at < end && (*at == 'e' || *at == 'E');
  constexpr std::uint64_t exact = 1ULL << 53U;
  constexpr std::ptrdiff_t longest = 20;  // 19 digits do not overflow
  if (has_exponent || at - first > longest || at - first < 1 || digits > exact ||
      decimals >= powers.size() || (at - first == 1 && *first == '.')) {
    return nullptr;
  }
  value = static_cast<double>(digits) / powers[decimals];
  value = negative ? -value : value;
  return at;
}

// How many cells of a line are numbers.
std::size_t count_numbers(const std::vector<std::string_view>& cells, bool decimal_comma) {
  return static_cast<std::size_t>(std::count_if(
      cells.begin(), cells.end(),
      [&](std::string_view cell) { return std::isfinite(cell_number(cell, decimal_comma)); }));
}

// The dialect in which most lines have the same number of cells, most of them numbers.
Dialect sniff(const std::vector<std::string_view>& lines) {
  Dialect best;
  double best_score = -1.0;
  for (const char delimiter : {',', ';', '\t', ' '}) {
    for (const bool decimal_comma : {false, true}) {
      if (decimal_comma && delimiter == ',') {
        continue;
      }
      std::map<std::size_t, double> numbers;  // in all lines of so many cells
      for (const std::string_view line : lines) {
        const std::vector<std::string_view> cells = cells_of(line, delimiter);
        numbers[cells.size()] += static_cast<double>(count_numbers(cells, decimal_comma));
      }
      for (const auto& [count, sum] : numbers) {
        if (sum > best_score) {
          best_score = sum;
          best = {.delimiter = delimiter, .decimal_comma = decimal_comma};
        }
      }
    }
  }
  return best;
}

class TextLog : public LogFile::Source {
 public:
  TextLog(ByteSource bytes, const std::vector<std::string>& names)
      : bytes_(std::move(bytes)), buffer_(1U << 18U) {
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
    while (rows < most && next_line(line)) {
      if (is_row(line) && parse(line, block, rows)) {
        ++rows;
      }
    }
    for (std::vector<double>& column : block) {
      column.resize(rows);
    }
    if (rows == 0 && rows_ == 0) {
      throw DataError(bytes_.path(), line_,
                      "no row of numbers follows; are the cells parted as in the first rows?");
    }
    rows_ += rows;
    return rows;
  }

 private:
  // Finds out what the text is from its first 64 KiB.
  void read_start(const std::vector<std::string>& names) {
    std::string_view start = bytes_.peek(1U << 16U);
    if (start.empty()) {
      throw DataError(bytes_.path(), "the file is empty");
    }
    if (start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF")) {
      throw DataError(bytes_.path(), 1, "UTF-16 text: save the file as UTF-8");
    }
    if (start.find('\0') != std::string_view::npos) {
      throw DataError(bytes_.path(), "is not text, and no format that is known (.npy, .mat)");
    }
    std::vector<std::string_view> lines;
    const bool has_all = start.size() < (1U << 16U);
    std::size_t at = start.starts_with("\xEF\xBB\xBF") ? 3 : 0;
    while (at < start.size() && lines.size() < 200) {
      const std::size_t end = start.find('\n', at);
      if (end == std::string_view::npos && !has_all && !lines.empty()) {
        break;  // the last line is cut
      }
      lines.push_back(start.substr(at, end == std::string_view::npos ? end : end - at));
      if (lines.back().ends_with('\r')) {
        lines.back().remove_suffix(1);
      }
      lines.back() = without_checksum(lines.back());
      at = end == std::string_view::npos ? start.size() : end + 1;
    }
    std::vector<std::string_view> content;
    std::copy_if(lines.begin(), lines.end(), std::back_inserter(content),
                 [](std::string_view line) { return !is_comment_line(line); });
    dialect_ = sniff(content);
    find_table(lines, names);
  }

  // The table begins at the first row of the usual number of cells that holds numbers; the line
  // before it, of as many cells, is the header.
  void find_table(const std::vector<std::string_view>& lines,
                  const std::vector<std::string>& names) {
    std::map<std::size_t, std::size_t> numbers;  // in lines of so many cells
    std::size_t usual = 0;
    for (const std::string_view line : lines) {
      const std::vector<std::string_view> cells = cells_of(line, dialect_.delimiter);
      const std::size_t count = count_numbers(cells, dialect_.decimal_comma);
      if (!is_comment_line(line) && count > 0) {
        numbers[cells.size()] += count;
        if (usual == 0 || numbers[cells.size()] > numbers[usual]) {
          usual = cells.size();
        }
      }
    }
    if (usual == 0) {
      throw DataError(bytes_.path(), 1,
                      formatted("no row of numbers in the first {} lines", lines.size()));
    }
    std::size_t header = lines.size();
    std::size_t first = 0;
    for (; first < lines.size(); ++first) {
      const std::vector<std::string_view> cells = cells_of(lines[first], dialect_.delimiter);
      if (is_comment_line(lines[first]) || cells.size() != usual) {
        continue;
      }
      if (2 * count_numbers(cells, dialect_.decimal_comma) > usual) {
        break;
      }
      header = first;
    }
    if (header < first && names.empty()) {
      for (const std::string_view cell : cells_of(lines[header], dialect_.delimiter)) {
        columns.emplace_back(cell_name(cell));
      }
      check_names(header + 1);
    } else {
      columns = column_names(bytes_.path(), names, usual);
      if (names.empty()) {
        notes.push_back("the log has no header; its columns are called " + joined(columns));
      }
    }
    skip_ = std::min(first, lines.size());
    const std::size_t before = header < first ? header : first;
    const auto preamble = static_cast<std::size_t>(
        std::count_if(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(before),
                      [](std::string_view line) { return !is_comment_line(line); }));
    if (preamble > 0) {
      notes.push_back(formatted("{} lines before the table were skipped", preamble));
    }
    if (dialect_.delimiter != ',' || dialect_.decimal_comma) {
      const std::string name = dialect_.delimiter == ' '    ? "blanks"
                               : dialect_.delimiter == '\t' ? "tabs"
                                                            : std::string(1, dialect_.delimiter);
      notes.push_back(formatted("cells parted by {}{}", name,
                                dialect_.decimal_comma ? ", with decimal commas" : ""));
    }
  }

  void check_names(std::size_t line) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i].empty()) {
        columns[i] = formatted("c{}", i + 1);
      }
      if (std::find(columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(i),
                    columns[i]) != columns.begin() + static_cast<std::ptrdiff_t>(i)) {
        throw DataError(bytes_.path(), line, formatted("column '{}': is there twice", columns[i]));
      }
    }
  }

  bool is_row(std::string_view line) const {
    return line_ > skip_ && !line.empty() && line.front() != '#' && line.front() != '%' &&
           line.find_first_not_of(" \t\r") != std::string_view::npos;
  }

  // The next line without its end; false at the end of the file.
  bool next_line(std::string_view& line) {
    std::size_t searched = begin_;
    for (;;) {
      if (searched < filled_) {
        if (const void* newline =
                std::memchr(buffer_.data() + searched, '\n', filled_ - searched)) {
          const auto end =
              static_cast<std::size_t>(static_cast<const char*>(newline) - buffer_.data());
          line = std::string_view(buffer_.data() + begin_, end - begin_);
          begin_ = end + 1;
          ++line_;
          return true;
        }
        searched = filled_;
      }
      if (at_end_) {
        line = std::string_view(buffer_.data() + begin_, filled_ - begin_);
        begin_ = filled_;
        ++line_;
        return !line.empty();
      }
      if (filled_ - begin_ > longest_row) {
        throw DataError(bytes_.path(), line_ + 1, "a row of more than 1 MiB: is this a text file?");
      }
      if (begin_ > 0) {
        std::memmove(buffer_.data(), buffer_.data() + begin_, filled_ - begin_);
        searched -= begin_;
        filled_ -= begin_;
        begin_ = 0;
      }
      if (filled_ == buffer_.size()) {
        buffer_.resize(2 * buffer_.size());
      }
      const std::size_t count = bytes_.read(buffer_.data() + filled_, buffer_.size() - filled_);
      filled_ += count;
      at_end_ = count == 0;
    }
  }

  // @return whether the row has as many cells as the table has columns.
  bool parse(std::string_view line, LogBlock& block, std::size_t row) {
    if (!line.empty() && line.back() == '\r') {
      line.remove_suffix(1);
    }
    line = without_checksum(line);
    const bool good = dialect_.delimiter == ' ' || dialect_.decimal_comma
                          ? parse_slowly(line, block, row)
                          : parse_quickly(line, block, row);
    if (!good) {
      if (defects.ragged_rows++ == 0) {
        defects.first_ragged_line = line_;
      }
    }
    return good;
  }

  void put(LogBlock& block, std::size_t column, std::size_t row, double value) {
    if (place_[column] >= 0) {
      block[static_cast<std::size_t>(place_[column])][row] = value;
      if (!std::isfinite(value) && defects.missing_numbers++ == 0) {
        defects.first_missing_line = line_;
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
        if (is_number && (stop == end || *stop == dialect_.delimiter)) {
          cell_end = stop;
        } else {
          const void* const found =
              std::memchr(at, dialect_.delimiter, static_cast<std::size_t>(end - at));
          cell_end = found != nullptr ? static_cast<const char*>(found) : end;
          value = cell_number(trimmed({at, static_cast<std::size_t>(cell_end - at)}), false);
        }
        put(block, column, row, value);
      } else {
        const void* const found =
            std::memchr(at, dialect_.delimiter, static_cast<std::size_t>(end - at));
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

  bool parse_slowly(std::string_view line, LogBlock& block, std::size_t row) {
    const std::vector<std::string_view> cells = cells_of(line, dialect_.delimiter);
    if (cells.size() != columns.size()) {
      return false;
    }
    for (std::size_t column = 0; column < cells.size(); ++column) {
      if (place_[column] >= 0) {
        put(block, column, row, cell_number(cells[column], dialect_.decimal_comma));
      }
    }
    return true;
  }

  ByteSource bytes_;
  Dialect dialect_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t filled_ = 0;
  bool at_end_ = false;
  std::size_t line_ = 0;  // where the line last read stands
  std::size_t skip_ = 0;  // lines before the first row
  std::size_t rows_ = 0;
  std::vector<int> place_;  // where each column stands in a block; -1: not wanted
  std::size_t selected_ = 0;
};

}  // namespace

std::unique_ptr<LogFile::Source> open_text_log(ByteSource bytes,
                                               const std::vector<std::string>& names) {
  return std::make_unique<TextLog>(std::move(bytes), names);
}

}  // namespace axiscal
