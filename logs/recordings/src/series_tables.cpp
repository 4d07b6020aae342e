// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/series_tables.hpp"

#include <utility>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {

void SeriesTables::add(const std::string& name,
                       std::size_t rows,
                       std::size_t columns,
                       const std::vector<double>& values) {
  const bool transposed = rows < columns;  // each row is then a series of samples
  if (transposed) {
    std::swap(rows, columns);
  }
  Table& table = tables_[rows];
  for (std::size_t c = 0; c < columns; ++c) {
    table.names.push_back(columns == 1 ? name : formatted("{}_{}", name, c + 1));
    std::vector<double>& column = table.data.emplace_back(rows);
    for (std::size_t r = 0; r < rows; ++r) {
      column[r] = transposed ? values[r * columns + c] : values[c * rows + r];
    }
  }
}

SeriesTables::Table SeriesTables::take_largest(const std::string& path) && {
  Table* best = nullptr;
  std::size_t most = 0;
  for (auto& [rows, table] : tables_) {
    if (rows * table.data.size() > most && rows > 1) {
      most = rows * table.data.size();
      best = &table;
    }
  }
  if (best == nullptr) {
    throw DataError(path, "the file contains no column of numbers");
  }
  return std::move(*best);
}

std::unique_ptr<LogFile::Source> SeriesTables::largest(const std::string& path) && {
  Table table = std::move(*this).take_largest(path);
  return std::make_unique<LogInMemory>(std::move(table.names), std::move(table.data));
}

}  // namespace axiscal
