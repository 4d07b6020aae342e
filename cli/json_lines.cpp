// SPDX-License-Identifier: Apache-2.0
#include "json_lines.hpp"

#include <cmath>
#include <optional>

#include <nlohmann/json.hpp>

#include "axiscal/core/number_text.hpp"

namespace axiscal::cli {

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells(1);
  bool is_quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool is_doubled = is_quoted && line[i] == '"' && line.substr(i + 1).starts_with('"');
    if (is_doubled) {
      cells.back() += line[i++];
    } else if (line[i] == '"') {
      is_quoted = !is_quoted;
    } else if (line[i] == ',' && !is_quoted) {
      cells.emplace_back();
    } else {
      cells.back() += line[i];
    }
  }
  return cells;
}

namespace {

nlohmann::ordered_json value_of(const std::string& cell) {
  const std::optional<double> number = parse_number(cell);
  if (number) {
    return *number;
  }
  return cell.empty() || cell == "nan" ? nlohmann::ordered_json() : nlohmann::ordered_json(cell);
}

}  // namespace

std::string JsonLines::of(std::string_view csv) {
  std::string lines;
  rest_ += csv;
  std::size_t start = 0;
  for (std::size_t end = rest_.find('\n'); end != std::string::npos;
       start = end + 1, end = rest_.find('\n', start)) {
    const std::vector<std::string> cells =
        cells_of(without_returns(std::string_view(rest_).substr(start, end - start)));
    if (names_.empty()) {
      names_ = cells;
      continue;
    }
    nlohmann::ordered_json row = nlohmann::ordered_json::object();
    for (std::size_t i = 0; i < cells.size() && i < names_.size(); ++i) {
      row[names_[i]] = value_of(cells[i]);
    }
    lines += row.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
  }
  rest_.erase(0, start);
  return lines;
}

}  // namespace axiscal::cli
