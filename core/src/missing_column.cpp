// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/missing_column.hpp"

#include <string_view>

#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::string message_of(const std::string& column, const std::vector<std::string>& columns) {
  const std::vector<std::string_view> names(columns.begin(), columns.end());
  std::string lead;
  if (names.size() == 1) {
    const bool semicolons = names.front().find(';') != std::string_view::npos;
    const bool tabs = names.front().find('\t') != std::string_view::npos;
    lead = semicolons || tabs
               ? formatted("the cells are separated by {}, but commas are needed here: ",
                           semicolons ? "semicolons" : "tabs")
               : "";
  }
  return formatted("{}column '{}' is missing. The columns are: {}{}", lead, column, joined(columns),
                   did_you_mean(column, names));
}

std::string place_of(const std::string& path, std::size_t line) {
  return line > 0 ? formatted("{}:{}", path, line) : path;
}

}  // namespace

MissingColumnError::MissingColumnError(const std::string& path,
                                       std::size_t line,
                                       std::string column,
                                       std::vector<std::string> columns)
    : DataError(place_of(path, line), message_of(column, columns)),
      place_(place_of(path, line)),
      column_(std::move(column)),
      columns_(std::move(columns)) {}

DataError MissingColumnError::with(const std::string& words) const {
  return {place_, message_of(column_, columns_) + words};
}

}  // namespace axiscal
