// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/table_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>

#include "axiscal/core/error.hpp"
#include "axiscal/core/missing_column.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/settings.hpp"
#include "axiscal/logs/text_row.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/line_stream.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/sensor_data.hpp"
#include "logs/recordings/src/table_of_series.hpp"
#include "logs/recordings/src/text_encoding.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

bool is_called(const std::string& column, const std::string& name) {
  return column == name;
}

bool is_called_in_other_letters(const std::string& column, const std::string& name) {
  return to_lower_case(column) == to_lower_case(name);
}

// @return true if `name` is rest, fence, run or block, and the name of a column contains it and
//         further words, such as "Rest face", "fence_face" or "pose.rest". Other names must match
//         exactly, because an axis may have a name such as SLOT.axis.
bool is_called_with_more(const std::string& column, const std::string& name) {
  if (name != "rest" && name != "fence" && name != "run" && name != "block") {
    return false;
  }
  const std::string small = to_lower_case(column);
  return small.starts_with(name + " ") || small.starts_with(name + "_") ||
         small.ends_with("." + name);
}

// Names the columns of a table without a header that has two adjacent columns of faces, such as +X
// or -Z. These are named "rest" and "fence". A column of whole numbers before them is named "run",
// and the three columns after them "x", "y" and "z".
// @return the names; empty if the table has other columns.
std::vector<std::string> names_by_faces(const std::vector<std::vector<std::string_view>>& rows) {
  const auto are = [&](std::size_t c, auto is) {
    return std::all_of(rows.begin(), rows.end(), [&](const auto& row) { return is(row[c]); });
  };
  const auto is_face = [](std::string_view cell) {
    return cell.size() == 2 &&
           ((cell.find_first_of("+-") == 0 && cell.find_first_of("xyzXYZ") == 1) ||
            (cell.find_first_of("+-") == 1 && cell.find_first_of("xyzXYZ") == 0));
  };
  const std::size_t n = rows.front().size();
  for (std::size_t c = 0; c + 1 < n; ++c) {
    if (!are(c, is_face) || !are(c + 1, is_face)) {
      continue;
    }
    if (n - c - 2 != 3 || c > 1 || (c == 1 && !are(0, [](std::string_view cell) {
                                      return parse_integer(cell).has_value();
                                    }))) {
      return {};
    }
    std::vector<std::string> names = {"rest", "fence", "x", "y", "z"};
    if (c == 1) {
      names.insert(names.begin(), "run");
    }
    return names;
  }
  return {};
}

// Converts a table of numbers to text.
class NumbersAsText {
 public:
  explicit NumbersAsText(std::unique_ptr<LogFile::Source> source) : source_(std::move(source)) {}

  void scale(std::vector<double> factors) { factors_ = std::move(factors); }

  // @return the first rows; read() returns them as text afterwards.
  const LogBlock& look_ahead() {
    is_ahead_ = source_->read(block_, rows_at_once) > 0;
    return block_;
  }

  std::size_t read(char* buffer, std::size_t size) {
    while (given_ == text_.size()) {
      text_.clear();
      given_ = 0;
      if (!is_ahead_ && source_->read(block_, rows_at_once) == 0) {
        return 0;
      }
      is_ahead_ = false;
      for (std::size_t row = 0; row < block_.front().size(); ++row) {
        for (std::size_t c = 0; c < block_.size(); ++c) {
          const double value = (c < factors_.size() ? factors_[c] : 1.0) * block_[c][row];
          text_ += c > 0 ? "," : "";
          text_ += std::isfinite(value) ? number_text(value) : "nan";
        }
        text_ += '\n';
      }
    }
    const std::size_t count = text_.copy(buffer, size, given_);
    given_ += count;
    return count;
  }

 private:
  static constexpr std::size_t rows_at_once = 4096;
  std::unique_ptr<LogFile::Source> source_;
  LogBlock block_;
  bool is_ahead_ = false;  // true if look_ahead() has read the block, and read() has not used it
  std::vector<double> factors_;
  std::string text_;
  std::size_t given_ = 0;
};

}  // namespace

struct TableText::State {
  std::string path;
  LogFormat format;
  TextLayout layout;
  bool is_plain = true;    // true if read() returns the unchanged bytes
  bool has_names = false;  // true if names_by_faces() has named the columns
  std::vector<NamedColumn> columns;
  std::vector<std::string> header;  // names of the columns; if empty, those in the file are used
  std::vector<double> factors;      // factor of each column
  // Functions that convert the cells of a column. Key: index of the column.
  std::map<std::size_t, std::function<std::string(const std::string&)>> of_cell;
  LogBlock first_rows;
  std::vector<std::vector<std::string>> first_cells;
  std::string table_name;
  std::vector<LogSensor> sensors;  // only set if the file is a recording
  std::vector<std::string> notes;
  std::optional<ByteSource> bytes;
  std::unique_ptr<NumbersAsText> numbers;
  // State of next_line(): the source of lines, the converted line, and how much of it was read.
  std::unique_ptr<LineStream> lines;
  std::string line;
  std::size_t given = 0;

  void open(OpenedFile opened);
  void open_series(OpenedFile opened, ReopenableFile& file);
  void look_at_text();
  void look_at_first_rows(std::string_view start, bool is_whole);
  void look_at_numbers(std::unique_ptr<LogFile::Source> source);
  void map_columns();
  TableColumns known_columns() const;
  std::size_t read(char* buffer, std::size_t size);
  bool next_line();
};

void TableText::State::open(OpenedFile opened) {
  table_name = opened.table_name;
  if (!opened.is_table()) {
    constexpr std::size_t looked_at = 100000;
    throw DataError(
        path,
        formatted("is a recording ({}), not a table of readings in known orientations; {}. If the "
                  "instrument was turned by hand, give the method 'magnitude' and the kind of "
                  "instrument",
                  opened.format, series_list(summarise(*opened.decoder, looked_at))),
        {settings::log});
  }
  if (opened.text) {
    bytes = as_utf8(*std::move(opened.text));
    look_at_text();
  } else {
    look_at_numbers(std::move(opened.table));
  }
  map_columns();
}

// Makes a table from a recording, with the sensors that `format.kinds` requests.
void TableText::State::open_series(OpenedFile opened, ReopenableFile& file) {
  constexpr std::size_t looked_at = 400000;
  OpenedTable table =
      table_of_series(path, summarise(*opened.decoder, looked_at), file.open().decoder, format);
  notes = table.source->notes;
  sensors = std::move(table.sensors);
  look_at_numbers(std::move(table.source));
  for (const LogSensor& sensor : sensors) {
    for (NamedColumn& column : columns) {
      if (std::find(sensor.columns.begin(), sensor.columns.end(), column.name) !=
          sensor.columns.end()) {
        column.unit = sensor.unit;
      }
    }
  }
  map_columns();
}

void TableText::State::look_at_text() {
  const auto [start, is_whole] = start_of_text(*bytes);
  if (!bytes->compression().empty()) {
    notes.push_back(formatted("unpacked ({})", bytes->compression()));
  }
  const bool is_text = start.find('\0') == std::string_view::npos;
  try {
    if (!is_text) {
      return;
    }
    layout = detect_text_layout(path, start, is_whole, {});
  } catch (const DataError&) {
    return;  // the CsvReader will report the error
  }
  if (!format.names.empty()) {
    layout.columns = column_names(path, format.names, layout.columns.size());
  }
  if (!layout.has_header && format.names.empty()) {
    std::vector<std::vector<std::string_view>> rows;
    for (const std::string_view one : first_lines(start, is_whole)) {
      std::vector<std::string_view> cells = layout.cells_of_row(one);
      if (!is_comment_line(one) && cells.size() == layout.columns.size()) {
        rows.push_back(std::move(cells));
      }
    }
    const std::vector<std::string> names =
        rows.empty() ? std::vector<std::string>{} : names_by_faces(rows);
    if (!names.empty()) {
      layout.columns = names;
      layout.notes = {
          "the table has no header; the faces in its rows show the names of its "
          "columns: " +
          joined(names)};
      has_names = true;
    }
  }
  for (const std::string& name : layout.columns) {
    columns.push_back(named_column(name));
  }
  look_at_first_rows(start, is_whole);
  // In plain CSV, the header is the first line that is neither empty nor a comment.
  std::size_t first = 1;
  for (const std::string_view one : first_lines(start, is_whole)) {
    const std::string_view text = trimmed(one);
    if (!text.empty() && text.front() != '#' && text != "\xEF\xBB\xBF") {
      break;
    }
    ++first;
  }
  const bool has_units_row = layout.has_header && layout.first_row_line > layout.header_line + 1;
  bool gap_is_blank = true;
  if (has_units_row) {
    std::size_t number = 0;
    for (const std::string_view one : first_lines(start, is_whole)) {
      ++number;
      if (number > layout.header_line && number < layout.first_row_line && !is_comment_line(one)) {
        gap_is_blank = false;
      }
    }
  }
  const bool plain_header =
      layout.has_header && layout.header_line == first && !layout.header_is_odd;
  const bool any_dressed = std::find(layout.is_dressed.begin(), layout.is_dressed.end(), true) !=
                           layout.is_dressed.end();
  is_plain = layout.delimiter == ',' && !layout.decimal_comma && plain_header && gap_is_blank &&
             !layout.first_is_empty && !layout.last_is_empty &&
             start.find('\'') == std::string_view::npos && format.names.empty() && !any_dressed &&
             is_utf8(start.substr(0, start.rfind('\n') + 1));
  if (!layout.has_header && !has_names && format.names.empty() && layout.delimiter == ',' &&
      first == 1 && !layout.decimal_comma && layout.first_row_line != first) {
    // The line above the first row is not a header, so the CsvReader will report it.
    is_plain = true;
    columns.clear();
  }
  if (!is_plain) {
    notes.insert(notes.end(), layout.notes.begin(), layout.notes.end());
  }
}

void TableText::State::look_at_first_rows(std::string_view start, bool is_whole) {
  first_rows.assign(layout.columns.size(), {});
  std::size_t number = 0;
  for (const std::string_view line_of_row : first_lines(start, is_whole)) {
    const std::vector<std::string_view> cells = layout.cells_of_row(without_checksum(line_of_row));
    if (++number < layout.first_row_line || is_comment_line(line_of_row) ||
        cells.size() != layout.columns.size()) {
      continue;
    }
    std::vector<std::string>& row = first_cells.emplace_back();
    for (std::size_t c = 0; c < cells.size(); ++c) {
      row.emplace_back(cell_name(cells[c]));
      first_rows[c].push_back(layout.is_clock[c] ? clock_seconds(cells[c])
                              : layout.is_dressed[c]
                                  ? parse_decorated_number(cells[c], layout.decimal_comma).value
                                  : cell_number(cells[c], layout.decimal_comma));
    }
  }
}

void TableText::State::look_at_numbers(std::unique_ptr<LogFile::Source> source) {
  if (!format.names.empty()) {
    source->columns = column_names(path, format.names, source->columns.size());
  }
  for (const std::string& name : source->columns) {
    columns.push_back(named_column(name));
  }
  header = source->columns;
  is_plain = true;
  numbers = std::make_unique<NumbersAsText>(std::move(source));
  first_rows = numbers->look_ahead();
}

// Renames the columns in `format.columns` and multiplies them by their factors (option --map).
void TableText::State::map_columns() {
  factors.assign(columns.size(), 1.0);
  if (format.columns.empty()) {
    return;
  }
  if (header.empty()) {
    header = layout.columns;
  }
  const std::vector<std::string> before = header;
  for (const MappedColumn& mapped : format.columns) {
    const std::size_t at = need_column(path, before, mapped.column);
    header[at] = mapped.name;
    columns[at] = {.name = mapped.name};
    factors[at] = mapped.factor;
    is_plain = is_plain && mapped.factor == 1.0;
    notes.push_back(formatted("column '{}' is {}the file's column '{}'", mapped.name,
                              mapped.factor == 1.0 ? "" : number_text(mapped.factor) + " times ",
                              mapped.column));
  }
}

// Converts the next line to CSV. A line that is not a row becomes an empty line, so that the line
// numbers agree with those in the file.
bool TableText::State::next_line() {
  std::string_view raw;
  if (!lines->next(raw)) {
    return false;
  }
  line.clear();
  given = 0;
  const std::size_t number = lines->line();
  if (number < layout.first_row_line || is_comment_line(raw)) {
    line = "\n";
    return true;
  }
  const std::vector<std::string_view> cells = layout.cells_of_row(without_checksum(raw));
  for (std::size_t c = 0; c < cells.size(); ++c) {
    if (c > 0) {
      line += ',';
    }
    std::string cell(cells[c]);
    if (cell.size() > 1 && cell.front() == cell.back() &&
        (cell.front() == '"' || cell.front() == '\'')) {
      cell = cell.substr(1, cell.size() - 2);
      for (std::size_t at = cell.find("\"\""); at != std::string::npos;
           at = cell.find("\"\"", at + 1)) {
        cell.erase(at, 1);
      }
    }
    if (c < layout.is_dressed.size() && layout.is_dressed[c]) {
      const double undressed = parse_decorated_number(cell, layout.decimal_comma).value;
      if (std::isfinite(undressed)) {
        cell = number_text(undressed);
        std::replace(cell.begin(), cell.end(), '.', layout.decimal_comma ? ',' : '.');
      }
    }
    if (const auto of_column = of_cell.find(c); of_column != of_cell.end()) {
      cell = of_column->second(cell);
    }
    const double value = layout.decimal_comma || (c < factors.size() && factors[c] != 1.0)
                             ? cell_number(cell, layout.decimal_comma)
                             : std::nan("");
    if (std::isfinite(value)) {
      if (layout.decimal_comma) {
        std::replace(cell.begin(), cell.end(), ',', '.');
      }
      if (c < factors.size() && factors[c] != 1.0) {
        cell = number_text(value * factors[c]);
      }
    }
    line += csv_cell(is_utf8(cell) ? cell : utf8_of_latin1(cell));
  }
  line += '\n';
  return true;
}

std::size_t TableText::State::read(char* buffer, std::size_t size) {
  if (numbers) {
    return numbers->read(buffer, size);
  }
  if (is_plain) {
    return bytes->read(buffer, size);
  }
  while (given == line.size()) {
    if (!next_line()) {
      return 0;
    }
  }
  const std::size_t count = line.copy(buffer, size, given);
  given += count;
  return count;
}

TableColumns TableText::State::known_columns() const {
  std::vector<std::string> names;
  for (const NamedColumn& column : columns) {
    names.push_back(column.unit.empty() ? column.name : column.name + " (" + column.unit + ")");
  }
  LogBlock start = first_rows;
  start.resize(names.size());
  return recognise_columns(names, table_name, start);
}

TableText::TableText(const std::string& path, const LogFormat& format)
    : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->format = format;
  ReopenableFile file(path, format.limits);
  OpenedFile opened = file.open();
  if (!opened.is_table() && !format.kinds.empty()) {
    state_->open_series(std::move(opened), file);
    return;
  }
  file.disable_reopening();
  state_->open(std::move(opened));
}

TableText::TableText(std::string path,
                     std::function<std::size_t(char* buffer, std::size_t size)> read,
                     const LogFormat& format)
    : state_(std::make_unique<State>()) {
  state_->path = path;
  state_->format = format;
  state_->open(open_recording(ByteSource(path, std::move(read), format.limits)));
}

TableText::~TableText() = default;
TableText::TableText(TableText&&) noexcept = default;
TableText& TableText::operator=(TableText&&) noexcept = default;

const std::vector<NamedColumn>& TableText::columns() const {
  return state_->columns;
}

const std::vector<std::string>& TableText::notes() const {
  return state_->notes;
}

const LogBlock& TableText::first_rows() const {
  return state_->first_rows;
}

const std::vector<std::vector<std::string>>& TableText::first_cells() const {
  return state_->first_cells;
}

std::vector<std::string> TableText::unnamed_numbers() const {
  std::vector<std::string> names;
  const std::optional<std::size_t> time = state_->known_columns().time;
  for (std::size_t c = 0; c < state_->first_rows.size() && c < state_->columns.size(); ++c) {
    const std::vector<double>& values = state_->first_rows[c];
    const bool are_numbers = std::any_of(values.begin(), values.end(),
                                         [](double value) { return std::isfinite(value); });
    const bool is_text = c < state_->layout.is_text.size() && state_->layout.is_text[c];
    if (c != time && are_numbers && !is_text && is_generic_name(state_->columns[c].name)) {
      names.push_back(state_->columns[c].name);
    }
  }
  return names;
}

std::vector<LogSensor> TableText::sensors() const {
  if (!state_->sensors.empty()) {
    return state_->sensors;
  }
  std::vector<std::string> names;
  for (const NamedColumn& column : state_->columns) {
    names.push_back(column.unit.empty() ? column.name : column.name + " (" + column.unit + ")");
  }
  const TableColumns known = state_->known_columns();
  RecordingSummary summary{.format = "table"};
  const MessageSeries series("", 0, names, known.series);
  for (const MessageSeries::Part& part : series.parts()) {
    summary.series.push_back({.series = part.series, .samples = 2, .rate_hz = std::nan("")});
  }
  std::vector<LogSensor> all;
  for (const RecordedSensor& sensor : sensors_of(summary)) {
    LogSensor one{.kind = sensor.kind,
                  .unit = sensor.unit,
                  .words = words_of(sensor),
                  .is_guess = sensor.known_by == KnownBy::data};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      one.columns[axis] = named_column(sensor.columns[axis]).name;
    }
    all.push_back(std::move(one));
  }
  return all;
}

CsvReader TableText::reader(const std::vector<std::string>& known,
                            const std::vector<MappedColumn>& renamed,
                            CsvReader::Quotes quotes) {
  State& state = *state_;
  CsvReader::Source source = [&state](char* buffer, std::size_t size) {
    return state.read(buffer, size);
  };
  std::vector<std::string> header = !state.header.empty() ? state.header : state.layout.columns;
  const auto has = [&](const std::string& name) {
    return std::find(header.begin(), header.end(), name) != header.end();
  };
  for (const MappedColumn& one : renamed) {
    const auto column =
        std::find_if(state.columns.begin(), state.columns.end(),
                     [&](const NamedColumn& named) { return named.name == one.column; });
    const std::size_t at = column != state.columns.end() && header.size() == state.columns.size()
                               ? static_cast<std::size_t>(column - state.columns.begin())
                               : need_column(state.path, header, one.column);
    header[at] = one.name;
    if ((one.factor != 1.0 || one.of_cell) && at < state.factors.size()) {
      state.factors[at] *= one.factor;
      if (one.of_cell) {
        state.of_cell[at] = one.of_cell;
      }
      state.is_plain = false;
      if (state.layout.first_row_line <= state.layout.header_line) {
        state.layout.first_row_line = state.layout.header_line + 1;
      }
    }
  }
  if (state.numbers) {
    state.numbers->scale(state.factors);
    state.is_plain = true;
  }
  for (const std::string& name : known) {
    if (has(name) || header.size() != state.columns.size()) {
      continue;
    }
    for (const auto& is_same : {is_called, is_called_in_other_letters, is_called_with_more}) {
      std::vector<std::size_t> places;
      for (std::size_t c = 0; c < state.columns.size(); ++c) {
        const bool is_renamed =
            std::any_of(renamed.begin(), renamed.end(),
                        [&](const MappedColumn& one) { return one.name == header[c]; });
        if (!is_renamed && is_same(state.columns[c].name, name)) {
          places.push_back(c);
        }
      }
      if (places.size() == 1) {
        state.notes.push_back(
            formatted("column '{}' is used as '{}'", header[places.front()], name));
        header[places.front()] = name;
        break;
      }
    }
  }
  if (state.numbers || !state.is_plain) {
    if (!state.is_plain) {
      state.lines = std::make_unique<LineStream>(*std::move(state.bytes));
    }
    return {std::move(source), state.path, header, quotes};
  }
  CsvReader csv(std::move(source), state.path, quotes);
  if (!header.empty() && header.size() == csv.header().size()) {
    csv.rename(header);
  }
  return csv;
}

std::string marked_cell(const std::string& path, std::size_t line, const std::string& column) {
  constexpr std::size_t widest = 100;
  try {
    OpenedFile opened = open_recording(path);
    if (!opened.text) {
      return "";
    }
    ByteSource bytes = as_utf8(*std::move(opened.text));
    const auto [start, is_whole] = start_of_text(bytes);
    TextLayout layout;
    try {
      layout = detect_text_layout(path, start, is_whole, {});
    } catch (const DataError&) {
      return "";
    }
    LineStream lines(std::move(bytes));
    std::string_view text;
    while (lines.line() < line) {
      if (!lines.next(text)) {
        return "";
      }
    }
    std::size_t place = layout.columns.size();
    for (std::size_t c = 0; c < layout.columns.size(); ++c) {
      const std::string base = named_column(layout.columns[c]).name;
      if (layout.columns[c] == column || to_lower_case(base) == to_lower_case(column)) {
        place = c;
      }
    }
    const std::vector<std::string_view> cells = layout.cells_of_row(text);
    if (text.size() > widest || !is_utf8(text) || place >= cells.size() ||
        line < layout.first_row_line) {
      return text.size() > widest || !is_utf8(text) ? "" : "  " + std::string(text);
    }
    const auto at = static_cast<std::size_t>(cells[place].data() - text.data());
    std::string mark(at + 2, ' ');
    for (std::size_t i = 0; i < at; ++i) {
      mark[i + 2] = text[i] == '\t' ? '\t' : ' ';
    }
    return "  " + std::string(text) + "\n" + mark + "^";
  } catch (const Error&) {
    return "";
  }
}

}  // namespace axiscal
