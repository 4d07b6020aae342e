// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/log_file.hpp"

#include <algorithm>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/missing_column.hpp"
#include "axiscal/core/number_text.hpp"
#include "log_source.hpp"

namespace axiscal {

namespace {

constexpr std::size_t most_values_at_once = std::size_t{1} << 20U;  // 8 MiB

}  // namespace

LogInMemory::LogInMemory(std::vector<std::string> names, LogBlock data) : data_(std::move(data)) {
  columns = std::move(names);
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
    throw DataError(path, formatted("{} names are given for {} columns", names.size(), count));
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
  return found == columns.end() ? std::nullopt
                                : std::optional(static_cast<std::size_t>(found - columns.begin()));
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
  ByteSource bytes(path);
  const std::string_view start = bytes.peek(128);
  if (start.starts_with("\x93NUMPY")) {
    source_ = open_npy_log(std::move(bytes), format.names);
  } else if (start.starts_with("MATLAB 7.3 ")) {
    source_ = open_mat73_log(path);
  } else if (start.starts_with("MATLAB ")) {
    source_ = open_mat_log(std::move(bytes));
  } else {
    const std::string compression = bytes.compression();
    source_ = open_text_log(std::move(bytes), format.names);
    if (!compression.empty()) {
      source_->notes.push_back(formatted("unpacked ({})", compression));
    }
  }
  columns_ = source_->columns;
  factors_.assign(columns_.size(), 1.0);
  for (const MappedColumn& mapped : format.columns) {
    const std::size_t at = need_column(path_, source_->columns, mapped.column);
    columns_[at] = mapped.name;
    factors_[at] = mapped.factor;
    source_->notes.push_back(formatted(
        "column {} is {}{}", mapped.name,
        mapped.factor == 1.0 ? "" : number_text(mapped.factor) + " times ", mapped.column));
  }
  selected_ = factors_;
}

LogFile::LogFile(std::string name, std::vector<std::string> columns, LogBlock samples)
    : source_(std::make_unique<LogInMemory>(columns, std::move(samples))),
      columns_(std::move(columns)),
      factors_(columns_.size(), 1.0),
      selected_(factors_),
      path_(std::move(name)) {}

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

void LogFile::select(std::vector<std::size_t> columns) {
  selected_.clear();
  for (const std::size_t column : columns) {
    selected_.push_back(factors_[column]);
  }
  source_->select(columns);
}

std::size_t LogFile::read(LogBlock& block, std::size_t most) {
  // A line of text may have a hundred thousand cells: a block is bounded in values, not in rows
  // alone.
  const std::size_t rows =
      std::max<std::size_t>(1, most_values_at_once / std::max<std::size_t>(1, selected_.size()));
  const std::size_t count = source_->read(block, std::min(most, rows));
  for (std::size_t c = 0; c < block.size(); ++c) {
    if (selected_[c] != 1.0) {
      for (double& value : block[c]) {
        value *= selected_[c];
      }
    }
  }
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
