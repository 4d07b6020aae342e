// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/log_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/missing_column.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/signed_counts.hpp"
#include "axiscal/logs/time_column.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/sensor_data.hpp"
#include "logs/recordings/src/table_of_series.hpp"

namespace axiscal {

namespace {

constexpr std::size_t most_values_at_once = std::size_t{1} << 20U;  // 8 MiB of doubles

}  // namespace

LogInMemory::LogInMemory(std::vector<std::string> names, LogBlock data) : data_(std::move(data)) {
  columns = std::move(names);
  rows = data_.empty() ? 0 : data_.front().size();
  for (std::size_t c = 0; c < data_.size(); ++c) {
    selected_.push_back(c);
  }
}

void LogInMemory::select(const std::vector<std::size_t>& selected) {
  selected_ = selected;
}

std::size_t LogInMemory::read(LogBlock& block, std::size_t most) {
  const std::size_t count = std::min(most, data_.front().size() - next_);
  block.clear();
  for (const std::size_t c : selected_) {
    const auto from = data_[c].begin() + static_cast<std::ptrdiff_t>(next_);
    block.emplace_back(from, from + static_cast<std::ptrdiff_t>(count));
  }
  next_ += count;
  return count;
}

std::vector<std::string> column_names(const std::string& path,
                                      const std::vector<std::string>& names,
                                      std::size_t count) {
  if (!names.empty() && names.size() != count) {
    throw DataError(path, formatted("{} column names are given, but the file has {} columns",
                                    names.size(), count));
  }
  std::vector<std::string> all = names;
  for (std::size_t c = all.size(); c < count; ++c) {
    all.push_back(formatted("c{}", c + 1));
  }
  return all;
}

std::optional<std::size_t> find_column(const std::vector<std::string>& columns,
                                       const std::string& name) {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found != columns.end()) {
    return static_cast<std::size_t>(found - columns.begin());
  }
  // Otherwise the names are compared without units: "ax" finds "ax (m/s^2)", and "ax (m/s^2)" finds
  // "ax". Exactly one column must match.
  const std::string plain = named_column(name).name;
  const auto is_so = [&](const std::string& column) {
    return !plain.empty() && named_column(column).name == plain;
  };
  const auto first = std::find_if(columns.begin(), columns.end(), is_so);
  const bool is_one =
      first != columns.end() && std::none_of(std::next(first), columns.end(), is_so);
  return is_one ? std::optional(static_cast<std::size_t>(first - columns.begin())) : std::nullopt;
}

std::size_t need_column(const std::string& path,
                        const std::vector<std::string>& columns,
                        const std::string& name) {
  const std::optional<std::size_t> at = find_column(columns, name);
  if (!at) {
    throw MissingColumnError(path, 0, name, columns);
  }
  return *at;
}

LogFormat read_log_format(const std::string& path) {
  const JsonValue json = parse_json(read_whole_file(path), path);
  json.require_format("axiscal-log");
  LogFormat format;
  if (const auto names = json.find("names")) {
    format.names = names->texts();
  }
  if (const auto columns = json.find("columns")) {
    for (const std::string& name : columns->keys()) {
      const JsonValue value = columns->at(name);
      MappedColumn column{.name = name};
      if (value.is_text()) {
        column.column = value.text();
      } else {
        column.column = value.at("column").text();
        column.factor = value.find("factor") ? value.at("factor").number() : 1.0;
        if (column.factor == 0.0) {
          value.fail("factor must not be 0");
        }
      }
      format.columns.push_back(std::move(column));
    }
  }
  return format;
}

LogFile::LogFile(const std::string& path, const LogFormat& format) : path_(path) {
  ReopenableFile file(path, format.limits);
  OpenedFile opened = file.open();
  if (opened.is_table()) {
    file.disable_reopening();
  }
  read_table(opened, format.names);
  format_ = opened.format;
  instance_ = format.instance;
  table_name_ = opened.table_name;
  if (opened.is_table()) {
    source_ = std::move(opened.table);
  } else {
    constexpr std::size_t looked_at = 400000;
    const RecordingSummary summary = summarise(*opened.decoder, looked_at);
    OpenedTable table = table_of_series(path, summary, file.open().decoder, format);
    is_table_ = false;
    source_ = std::move(table.source);
    sensors_ = std::move(table.sensors);
  }
  for (std::size_t c = 0; c < source_->columns.size(); ++c) {
    const std::vector<std::size_t>& text = source_->is_text;
    const bool is_mapped = std::any_of(
        format.columns.begin(), format.columns.end(),
        [&](const MappedColumn& mapped) { return mapped.column == source_->columns[c]; });
    if (is_mapped || std::find(text.begin(), text.end(), c) == text.end()) {
      places_.push_back(c);
      columns_.push_back(source_->columns[c]);
    }
  }
  factors_.assign(columns_.size(), 1.0);
  const std::vector<std::string> before = columns_;
  for (const MappedColumn& mapped : format.columns) {
    const std::size_t at = need_column(path_, before, mapped.column);
    columns_[at] = mapped.name;
    factors_[at] = mapped.factor;
    source_->notes.push_back(formatted(
        "column '{}' is {}the file's column '{}'", mapped.name,
        mapped.factor == 1.0 ? "" : number_text(mapped.factor) + " times ", mapped.column));
  }
  select_all();
}

LogFile::LogFile(std::string name, std::vector<std::string> columns, LogBlock samples)
    : source_(std::make_unique<LogInMemory>(columns, std::move(samples))),
      columns_(std::move(columns)),
      factors_(columns_.size(), 1.0),
      places_(columns_.size()),
      path_(std::move(name)) {
  std::iota(places_.begin(), places_.end(), std::size_t{0});
  selected_ = places_;
}

void LogFile::select_all() {
  selected_.resize(columns_.size());
  std::iota(selected_.begin(), selected_.end(), std::size_t{0});
  source_->select(places_);
}

LogFile::~LogFile() = default;
LogFile::LogFile(LogFile&&) noexcept = default;
LogFile& LogFile::operator=(LogFile&&) noexcept = default;

const std::vector<std::string>& LogFile::columns() const {
  return columns_;
}
const LogDefects& LogFile::defects() const {
  return source_->defects;
}
const std::vector<std::string>& LogFile::notes() const {
  return source_->notes;
}
const std::string& LogFile::path() const {
  return path_;
}

std::size_t LogFile::need(const std::string& name) const {
  return need_column(path_, columns_, name);
}

std::optional<double> LogFile::stated_rate_hz() const {
  return source_->rate_hz > 0.0 ? std::optional(source_->rate_hz) : std::nullopt;
}

bool LogFile::has_text_column(const std::string& name) const {
  return std::any_of(source_->is_text.begin(), source_->is_text.end(),
                     [&](std::size_t column) { return source_->columns[column] == name; });
}

void LogFile::look_ahead() {
  constexpr std::size_t rows_looked_at = 8192;
  if (ahead_.empty()) {
    const std::size_t rows = std::min(rows_looked_at, rows_at_once(columns_.size()));
    static_cast<void>(source_->read(ahead_, rows));
    constexpr int fewest_bits = 12;
    const SignedCounts counts = find_signed_counts({ahead_.begin(), ahead_.end()}, fewest_bits);
    if (counts.bits > 0) {
      signed_bits_.assign(columns_.size(), 0);
      for (const std::size_t column : counts.columns) {
        signed_bits_[column] = counts.bits;
      }
      source_->notes.push_back(words_of(counts, columns_));
    }
    scale(ahead_);
  }
}

std::string LogFile::time_column() {
  if (const auto named = find_time_column(path_, columns_, "")) {
    return named->name;
  }
  for (std::size_t c = 0; c < places_.size(); ++c) {
    if (source_->clock == places_[c]) {
      return columns_[c];
    }
  }
  if (!is_table_ || columns_.empty()) {
    return "";
  }
  look_ahead();
  const std::optional<std::size_t> time = recognise_columns(columns_, table_name_, ahead_).time;
  return time ? columns_[*time] : "";
}

std::vector<LogSensor> LogFile::sensors() {
  if (!sensors_.empty()) {
    return sensors_;
  }
  look_ahead();
  const TableColumns table = recognise_columns(columns_, table_name_, ahead_);
  // sensors_of() needs a RecordingSummary, so a summary that describes the columns is made here.
  RecordingSummary summary{.format = format_};
  const MessageSeries series("", 0, columns_, table.series);
  for (const MessageSeries::Part& part : series.parts()) {
    SeriesSummary& one = summary.series.emplace_back(
        SeriesSummary{.series = part.series,
                      .samples = std::max<std::size_t>(ahead_.front().size(), 2),
                      .rate_hz = not_a_number});
    for (const std::size_t column : part.places) {
      double low = std::numeric_limits<double>::infinity();
      double high = -low;
      for (const double value : ahead_[column]) {
        low = std::isfinite(value) ? std::min(low, value) : low;
        high = std::isfinite(value) ? std::max(high, value) : high;
      }
      one.sd.push_back(high > low ? high - low : 0.0);  // sensors_of() tests only whether sd is 0
    }
  }
  const std::vector<RecordedSensor> all = sensors_of(summary);
  const std::vector<std::string> dead = constant_sensor_notes(summary);
  source_->notes.insert(source_->notes.end(), dead.begin(), dead.end());
  for (const SeriesKind kind :
       {SeriesKind::accelerometer, SeriesKind::gyroscope, SeriesKind::magnetometer}) {
    const RecordedSensor* chosen = nullptr;
    int count = 0;
    for (const RecordedSensor& sensor : all) {
      if (sensor.kind == kind) {
        ++count;
        chosen = sensor.number <= instance_ ? &sensor : chosen;
      }
    }
    if (chosen != nullptr) {
      sensors_.push_back({.kind = kind,
                          .columns = chosen->columns,
                          .unit = chosen->unit,
                          .number = chosen->number,
                          .of = count,
                          .words = words_of(*chosen)});
    }
  }
  return sensors_;
}

void LogFile::select(std::vector<std::size_t> columns) {
  selected_ = std::move(columns);
  std::vector<std::size_t> places;
  for (const std::size_t column : selected_) {
    places.push_back(places_[column]);
  }
  source_->select(places);
}

void LogFile::scale(LogBlock& block) const {
  for (std::size_t c = 0; c < block.size(); ++c) {
    if (!signed_bits_.empty() && signed_bits_[selected_[c]] > 0) {
      for (double& value : block[c]) {
        value = with_sign(value, signed_bits_[selected_[c]]);
      }
    }
    const double factor = factors_[selected_[c]];
    if (factor != 1.0) {
      for (double& value : block[c]) {
        value *= factor;
      }
    }
  }
}

// Limits both the number of rows and the number of values in a block, because a line of text may
// have a hundred thousand cells.
std::size_t LogFile::rows_at_once(std::size_t columns) {
  return std::max<std::size_t>(1, most_values_at_once / std::max<std::size_t>(1, columns));
}

std::size_t LogFile::read(LogBlock& block, std::size_t most) {
  most = std::min(most, rows_at_once(selected_.size()));
  if (!ahead_.empty()) {  // look_ahead() has read rows with all columns
    const std::size_t count = std::min(most, ahead_.front().size() - ahead_given_);
    block.clear();
    for (const std::size_t column : selected_) {
      const auto from = ahead_[column].begin() + static_cast<std::ptrdiff_t>(ahead_given_);
      block.emplace_back(from, from + static_cast<std::ptrdiff_t>(count));
    }
    ahead_given_ += count;
    if (ahead_given_ == ahead_.front().size()) {
      ahead_.clear();
      ahead_given_ = 0;
    }
    if (count > 0) {
      return count;
    }
  }
  const std::size_t count = source_->read(block, most);
  scale(block);
  return count;
}

LogBlock read_log(LogFile& log) {
  LogBlock all;
  LogBlock block;
  while (log.read(block, 16384) > 0) {
    all.resize(block.size());
    for (std::size_t c = 0; c < block.size(); ++c) {
      all[c].insert(all[c].end(), block[c].begin(), block[c].end());
    }
  }
  return all;
}

}  // namespace axiscal
