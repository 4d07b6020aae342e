// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/text_layout.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_set>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/text_row.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/line_stream.hpp"
#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/text_encoding.hpp"

namespace axiscal {
namespace {

using Cells = std::vector<std::string_view>;

struct Dialect {
  char delimiter = ',';
  bool decimal_comma = false;
};

// @return true if a word after a number is a known unit.
bool is_unit_in_cell(std::string_view unit) {
  constexpr std::array<std::string_view, 12> others = {"s",  "ms",  "us",  "V",   "mV", "counts",
                                                       "Hz", "LSB", "deg", "rad", "A",  "mA"};
  return known_unit(unit).has_value() ||
         std::find(others.begin(), others.end(), unit) != others.end();
}

// True if a cell is a number that is followed by a unit or contains thousands separators.
bool is_dressed_number(std::string_view cell, bool decimal_comma) {
  const DecoratedNumber number = parse_decorated_number(cell, decimal_comma);
  return std::isfinite(number.value) &&
         (number.unit.empty() ? number.is_grouped : is_unit_in_cell(number.unit));
}

// @return how many cells of a line are numbers.
std::size_t count_numbers(const Cells& cells, bool decimal_comma) {
  return static_cast<std::size_t>(
      std::count_if(cells.begin(), cells.end(), [&](std::string_view cell) {
        return std::isfinite(cell_number(cell, decimal_comma)) ||
               is_dressed_number(cell, decimal_comma);
      }));
}

std::size_t count_filled(const Cells& cells) {
  return static_cast<std::size_t>(std::count_if(
      cells.begin(), cells.end(), [](std::string_view cell) { return !cell.empty(); }));
}

// Finds the delimiter and the decimal separator that give the most numeric cells. Numeric cells are
// counted together only for lines with the same number of cells.
Dialect sniff(const Cells& lines) {
  Dialect best;
  double best_score = -1.0;
  for (const char delimiter : {',', ';', '\t', '|', ' '}) {
    for (const bool decimal_comma : {false, true}) {
      if (decimal_comma && delimiter == ',') {
        continue;
      }
      // Key: number of cells in a line. Value: number of numeric cells in all such lines.
      std::map<std::size_t, double> numbers;
      for (const std::string_view line : lines) {
        const Cells cells = cells_of(line, delimiter);
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

bool is_a_unit(std::string_view cell) {
  cell = cell_name(cell);
  const bool in_brackets = cell.size() > 2 && ((cell.front() == '[' && cell.back() == ']') ||
                                               (cell.front() == '(' && cell.back() == ')'));
  constexpr std::array<std::string_view, 12> others = {"s", "ms", "us",     "ns",  "V", "mV",
                                                       "A", "mA", "counts", "LSB", "-", "1"};
  return in_brackets || known_unit(cell).has_value() ||
         std::find(others.begin(), others.end(), cell) != others.end();
}

// True if two filled cells are equal, which is possible in a row of units but not in one of names.
bool repeats(const Cells& cells) {
  std::unordered_set<std::string_view> seen;
  return std::any_of(cells.begin(), cells.end(), [&](std::string_view cell) {
    return !cell.empty() && !seen.insert(cell).second;
  });
}

// True if a row below the header contains units.
bool are_units(const Cells& cells) {
  const auto units = static_cast<std::size_t>(std::count_if(cells.begin(), cells.end(), is_a_unit));
  return units > 0 && (2 * units >= count_filled(cells) || repeats(cells));
}

// True if a row below the header contains the types of the columns.
bool are_types(const Cells& cells) {
  constexpr std::array<std::string_view, 14> types = {
      "float", "double",  "int",    "integer", "long", "number",   "bool",
      "str",   "boolean", "string", "text",    "date", "datetime", "timestamp"};
  return std::all_of(cells.begin(), cells.end(), [&](std::string_view cell) {
    const std::string_view word = cell_name(cell);
    return std::find(types.begin(), types.end(),
                     word.substr(0, word.find_first_of("0123456789"))) != types.end();
  });
}

bool is_nothing(const Cells& cells) {
  return std::all_of(cells.begin(), cells.end(), is_missing);
}

// @return the text of a comment, without the characters that begin the comment.
std::string_view uncommented(std::string_view line) {
  line = trimmed(line);
  const std::size_t at = line.find_first_not_of("#%/; \t");
  return at == std::string_view::npos ? std::string_view() : line.substr(at);
}

bool has_letter(const Cells& cells) {
  return std::any_of(cells.begin(), cells.end(), [](std::string_view cell) {
    return std::any_of(cell.begin(), cell.end(),
                       [](unsigned char c) { return std::isalpha(c) != 0; });
  });
}

std::string delimiter_words(char delimiter) {
  return delimiter == ' ' ? "blanks" : delimiter == '\t' ? "tabs" : std::string(1, delimiter);
}

class LayoutFinder {
 public:
  LayoutFinder(const std::string& path, Cells lines, const std::vector<std::string>& names)
      : path_(path), lines_(std::move(lines)) {
    Cells content;
    for (const std::string_view line : lines_) {
      if (!is_comment_line(line) && !is_separator_line(line)) {
        content.push_back(line);
      }
    }
    const Dialect dialect = sniff(content);
    layout_.delimiter = dialect.delimiter;
    layout_.decimal_comma = dialect.decimal_comma;
    for (const std::string_view line : lines_) {
      rows_.push_back(is_remark(line) || is_separator_line(line) || is_rule(line)
                          ? Cells{}
                          : cells_of(line, layout_.delimiter));
      numbers_.push_back(count_numbers(rows_.back(), layout_.decimal_comma));
    }
    find_usual();
    drop_empty_ends();
    find_first_row();
    find_header(names);
    look_at_columns();
    find_rate();
    find_empatica();
    say();
  }

  TextLayout take() && { return std::move(layout_); }

 private:
  // @return true if a line is a comment. In files of GCDC's loggers it may begin with a semicolon.
  [[nodiscard]] bool is_remark(std::string_view line) const {
    return is_comment_line(line) || (layout_.delimiter != ';' && trimmed(line).starts_with(';'));
  }

  // @return true for a line such as "sep=;", which spreadsheets write before the table.
  static bool is_separator_line(std::string_view line) {
    return line.starts_with("sep=") && line.size() <= 5;
  }

  // @return true for a line such as "|---|---|", which follows the header of a table in Markdown.
  static bool is_rule(std::string_view line) {
    return line.size() > 2 && line.find_first_not_of("|-+:= \t") == std::string_view::npos &&
           line.find("--") != std::string_view::npos;
  }

  // Removes the empty first or last cell of each row, if the rows begin or end with a delimiter.
  void drop_empty_ends() {
    bool first = usual_ > 1 && layout_.delimiter != ' ';
    bool last = first;
    for (const Cells& row : rows_) {
      if (row.size() == usual_) {
        first = first && row.front().empty();
        last = last && row.back().empty();
      }
    }
    first = first && layout_.delimiter == '|';
    layout_.first_is_empty = first;
    layout_.last_is_empty = last;
    const std::size_t fewer = (first ? 1U : 0U) + (last ? 1U : 0U);
    if (fewer == 0 || usual_ <= fewer) {
      layout_.first_is_empty = layout_.last_is_empty = false;
      return;
    }
    for (Cells& row : rows_) {
      if (row.size() == usual_) {
        row = Cells(row.begin() + (first ? 1 : 0), row.end() - (last ? 1 : 0));
      }
    }
    usual_ -= fewer;
  }

  void find_usual() {
    // Key: number of cells in a row. Value: number of numeric cells in all such rows.
    std::map<std::size_t, std::size_t> numbers;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (numbers_[i] > 0) {
        numbers[rows_[i].size()] += numbers_[i];
        if (usual_ == 0 || numbers[rows_[i].size()] > numbers[usual_]) {
          usual_ = rows_[i].size();
        }
      }
    }
    if (usual_ == 0) {
      throw DataError(path_, 1,
                      formatted("there is no row of numbers in the first {} lines", lines_.size()));
    }
  }

  // Finds the first row of the table. It has the usual number of cells, and more than half as many
  // numeric cells as the row with the most numeric cells.
  void find_first_row() {
    std::size_t most = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      most = rows_[i].size() == usual_ ? std::max(most, numbers_[i]) : most;
    }
    while (first_ < rows_.size() &&
           !(rows_[first_].size() == usual_ && 2 * numbers_[first_] > most)) {
      ++first_;
    }
    first_ = std::min(first_, lines_.size());
    while (first_ > 0 && has_gaps_alone(first_ - 1)) {
      --first_;  // a row with many missing values, such as "0,,,"
    }
    layout_.first_row_line = first_ + 1;
  }

  // True if all cells of a row are numbers or missing values.
  [[nodiscard]] bool has_gaps_alone(std::size_t i) const {
    return rows_[i].size() == usual_ && numbers_[i] > 0 &&
           std::all_of(rows_[i].begin(), rows_[i].end(), [&](std::string_view cell) {
             return is_missing(cell) || std::isfinite(cell_number(cell, layout_.decimal_comma));
           });
  }

  // Looks for a header whose number of cells differs from that of the rows.
  // @return the index of the nearest line above the rows that is not empty; nullopt if this line
  //         does not consist of names.
  [[nodiscard]] std::optional<std::size_t> odd_header() const {
    for (std::size_t i = first_; i-- > 0;) {
      const Cells& row = rows_[i];
      if (row.empty() || is_nothing(row)) {
        continue;
      }
      const bool fits = layout_.delimiter != ' ' || row.size() + 1 == usual_;
      const bool are_names = numbers_[i] == 0 && has_letter(row) && !repeats(row);
      return are_names && fits && row.size() > 1 && 2 * row.size() >= usual_ ? std::optional(i)
                                                                             : std::nullopt;
    }
    return std::nullopt;
  }

  // True if the first cells of the rows are 1, 2, 3, ..., which R writes as the names of the rows.
  [[nodiscard]] bool rows_are_named() const {
    double expected = 1.0;
    for (std::size_t i = first_; i < rows_.size(); ++i) {
      if (rows_[i].size() == usual_ &&
          cell_number(rows_[i].front(), layout_.decimal_comma) != expected++) {
        return false;
      }
    }
    return expected > 2.0;
  }

  // Changes the number of cells of a header to that of the rows. Cells are added or removed at the
  // end. If the first cells of the rows are their names (rows_are_named()), a cell is added in
  // front.
  Cells fitted(Cells cells) {
    layout_.header_is_odd = true;
    while (cells.size() > 1 && cells.back().empty()) {
      cells.pop_back();
    }
    const std::size_t named = cells.size();
    if (named + 1 == usual_ && rows_are_named()) {
      cells.insert(cells.begin(), std::string_view());
    }
    cells.resize(usual_);
    if (named < usual_) {
      layout_.notes.push_back(
          formatted("the header names {} of {} columns; the others are named by their numbers, "
                    "such as c{}",
                    named, usual_, usual_));
    } else if (named > usual_) {
      layout_.notes.push_back(
          formatted("the header names {} columns, but the rows have {} cells", named, usual_));
    }
    return cells;
  }

  void find_header(const std::vector<std::string>& names) {
    std::optional<std::size_t> header, units;
    for (std::size_t i = 0; i < first_; ++i) {
      if (rows_[i].size() != usual_ || is_nothing(rows_[i])) {
        continue;
      }
      if (header && numbers_[i] == 0 && are_units(rows_[i])) {
        units = i;
      } else if (!header || (!(repeats(rows_[i]) && !repeats(rows_[*header])) &&
                             !(numbers_[i] > 0 && numbers_[*header] == 0))) {
        units.reset();
        header = i;
      }
    }
    Cells cells = header ? rows_[*header] : Cells{};
    if (!header) {  // the header may be in a comment
      for (std::size_t i = 0; i < first_; ++i) {
        Cells words = cells_of(uncommented(lines_[i]), layout_.delimiter);
        constexpr std::array<std::string_view, 4> heads = {"Headers", "Header", "Columns",
                                                           "Fields"};
        if (words.size() == usual_ + 1 &&
            std::find(heads.begin(), heads.end(), words.front()) != heads.end()) {
          words.erase(words.begin());
        }
        if (is_remark(lines_[i]) && words.size() == usual_ && has_letter(words) &&
            count_numbers(words, layout_.decimal_comma) == 0) {
          header = i;
          cells = words;
        }
      }
    }
    if (!header && names.empty()) {
      header = odd_header();
      cells = header ? fitted(rows_[*header]) : Cells{};
    }
    before_ = header.value_or(first_);
    if (header && !is_remark(lines_[*header])) {
      begin_rows_behind(units.value_or(*header));
    }
    if (header && names.empty()) {
      layout_.has_header = true;
      layout_.header_line = *header + 1;
      for (std::size_t c = 0; c < cells.size(); ++c) {
        std::string name = printable_name(utf8_of_latin1(cell_name(cells[c])));
        if (units && c < rows_[*units].size() && !rows_[*units][c].empty()) {
          std::string_view unit = cell_name(rows_[*units][c]);
          if (unit.size() > 2 && ((unit.front() == '[' && unit.back() == ']') ||
                                  (unit.front() == '(' && unit.back() == ')'))) {
            unit = unit.substr(1, unit.size() - 2);
          }
          name += " (" + utf8_of_latin1(unit) + ")";
        }
        layout_.columns.push_back(std::move(name));
      }
      check_names(*header + 1);
    } else {
      layout_.columns = column_names(path_, names, usual_);
      if (names.empty()) {
        layout_.notes.push_back("the log has no header; its columns are named " +
                                joined(layout_.columns));
      }
    }
  }

  // Treats all lines after the header and its units as rows. The reader then reports those that
  // cannot be parsed.
  void begin_rows_behind(std::size_t head) {
    std::size_t first = head + 1;
    while (first < first_ && (rows_[first].empty() || are_types(rows_[first]))) {
      ++first;
    }
    layout_.first_row_line = first + 1;
  }

  void check_names(std::size_t line) {
    std::vector<std::string>& columns = layout_.columns;
    std::unordered_set<std::string> seen;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i].empty()) {
        columns[i] = formatted("c{}", i + 1);
      }
      if (!seen.insert(columns[i]).second) {
        throw DataError(path_, line,
                        formatted("column '{}': the header contains this name twice", columns[i]));
      }
    }
  }

  void look_at_columns() {
    layout_.is_text.assign(usual_, false);
    layout_.is_clock.assign(usual_, false);
    layout_.is_dressed.assign(usual_, false);
    for (std::size_t c = 0; c < usual_; ++c) {
      std::size_t numbers = 0;
      std::size_t plain = 0;
      std::size_t dressed = 0;
      std::optional<std::string> unit;  // the unit that follows the numbers
      bool one_unit = true;
      std::size_t texts = 0;
      std::size_t clocks = 0;
      for (std::size_t i = first_; i < rows_.size(); ++i) {
        if (rows_[i].size() != usual_ || rows_[i][c].empty()) {
          continue;
        }
        const std::string_view cell = cell_name(rows_[i][c]);
        const bool is_nan =
            cell == "nan" || cell == "NaN" || cell == "NAN" || cell == "inf" || cell == "-inf";
        if (std::isfinite(cell_number(cell, layout_.decimal_comma))) {
          ++numbers;
          ++plain;
        } else if (is_nan) {
          ++numbers;
        } else if (is_missing(cell)) {
          continue;
        } else if (is_dressed_number(cell, layout_.decimal_comma)) {
          const std::string own(parse_decorated_number(cell, layout_.decimal_comma).unit);
          one_unit = one_unit && (!unit || *unit == own);
          unit = own;
          ++dressed;
        } else if (std::isfinite(clock_seconds(cell))) {
          ++clocks;
        } else {
          ++texts;
        }
      }
      layout_.is_clock[c] = clocks > 0 && numbers == 0 && texts == 0;
      layout_.is_text[c] = texts > 0 && numbers == 0 && dressed == 0;
      // If some numbers have a unit and others do not, the file is regarded as wrong. Thousands
      // separators may be absent in some cells, because numbers below 1,000 have none.
      layout_.is_dressed[c] =
          dressed > 0 && one_unit && texts == 0 && clocks == 0 && (unit->empty() || plain == 0);
      if (layout_.is_dressed[c] && !unit->empty() && c < layout_.columns.size() &&
          named_column(layout_.columns[c]).unit.empty()) {
        layout_.columns[c] += " (" + *unit + ")";
      }
    }
  }

  // Recognises files of Empatica. Their first row contains the start time, and their second row
  // contains the rate, both repeated in every column.
  void find_empatica() {
    if (layout_.has_header || first_ + 2 >= rows_.size()) {
      return;
    }
    const auto all_are = [&](std::size_t row, double low, double high) {
      const double first = rows_[row].size() == usual_
                               ? cell_number(rows_[row].front(), layout_.decimal_comma)
                               : not_a_number;
      return first > low && first < high &&
             std::all_of(rows_[row].begin(), rows_[row].end(), [&](std::string_view cell) {
               return cell_number(cell, layout_.decimal_comma) == first;
             });
    };
    constexpr double first_s = 1e9;  // seconds since 1970
    constexpr double last_s = 2.2e9;
    if (!all_are(first_, first_s, last_s) || !all_are(first_ + 1, 0.5, 1e4) ||
        !(cell_number(rows_[first_ + 2].front(), layout_.decimal_comma) < 1e6)) {
      return;
    }
    layout_.rate_hz = cell_number(rows_[first_ + 1].front(), layout_.decimal_comma);
    layout_.notes.push_back(formatted(
        "the first two rows are the start time and the rate, {} Hz, as in Empatica's files",
        number_text(layout_.rate_hz)));
    layout_.first_row_line += 2;
  }

  // Finds the rate in a line before the table, such as "// Update Rate: 100.0Hz",
  // "OutputRate:,60Hz" or "# sample rate = 50 Hz".
  void find_rate() {
    for (std::size_t i = 0; i < before_; ++i) {
      const std::string_view line = lines_[i];
      const std::size_t at = line.find(" at ");  // ActiGraph: "date format M/d/yyyy at 30 Hz"
      const std::size_t rate = std::min({line.find("Rate"), line.find("rate"), at});
      const std::size_t hz = std::min(line.find("Hz"), line.find("hz"));
      if (rate == std::string_view::npos || hz == std::string_view::npos || hz < rate + 4) {
        continue;
      }
      const std::string_view between = line.substr(rate + 4, hz - rate - 4);
      const std::size_t first = between.find_first_of("0123456789");
      if (first != std::string_view::npos) {
        const double value = parse_number(trimmed(between.substr(first))).value_or(0.0);
        layout_.rate_hz = value > 0.0 ? value : 0.0;
      }
    }
  }

  void say() {
    const auto preamble = static_cast<std::size_t>(
        std::count_if(lines_.begin(), lines_.begin() + static_cast<std::ptrdiff_t>(before_),
                      [&](std::string_view line) { return !is_remark(line); }));
    if (preamble > 0) {
      layout_.notes.push_back(formatted("{} lines before the table were skipped", preamble));
    }
    if (layout_.delimiter != ',' || layout_.decimal_comma) {
      layout_.notes.push_back(formatted("separator {}{}", delimiter_words(layout_.delimiter),
                                        layout_.decimal_comma ? ", decimal comma" : ""));
    }
  }

  const std::string& path_;
  Cells lines_;
  std::vector<Cells> rows_;  // cells of each line; empty for a comment
  std::vector<std::size_t> numbers_;
  std::size_t usual_ = 0;   // usual number of cells in a row
  std::size_t first_ = 0;   // index of the table's first row in rows_
  std::size_t before_ = 0;  // number of lines before the table
  TextLayout layout_;
};

}  // namespace

TextLayout detect_text_layout(const std::string& path,
                              std::string_view start,
                              bool is_whole,
                              const std::vector<std::string>& names) {
  if (start.starts_with("\xEF\xBB\xBF")) {
    start.remove_prefix(3);
  }
  std::vector<std::string_view> lines = first_lines(start, is_whole);
  for (std::string_view& line : lines) {
    line = without_checksum(line);
  }
  return LayoutFinder(path, std::move(lines), names).take();
}

std::vector<std::string_view> TextLayout::cells_of_row(std::string_view line) const {
  std::vector<std::string_view> cells = cells_of(line, delimiter);
  if (last_is_empty && cells.size() > 1 && cells.back().empty()) {
    cells.pop_back();
  }
  if (first_is_empty && cells.size() > 1 && cells.front().empty()) {
    cells.erase(cells.begin());
  }
  return cells;
}

double clock_seconds(std::string_view cell) {
  return parse_clock_time(cell_name(cell)).value_or(not_a_number);
}

}  // namespace axiscal
