// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "logs/recordings/src/log_source.hpp"

namespace axiscal {

/// The numeric variables of a file. Variables with the same number of rows form one table.
class SeriesTables {
 public:
  /// Adds a variable with the size rows x columns, whose values are stored column by column. If it
  /// has fewer rows than columns, it is transposed.
  void add(const std::string& name,
           std::size_t rows,
           std::size_t columns,
           const std::vector<double>& values);

  /// @return the table with the largest number of values, rows x columns.
  /// @throws DataError  if there is no table with more than one row.
  [[nodiscard]] std::unique_ptr<LogFile::Source> largest(const std::string& path) &&;

  struct Table {
    std::vector<std::string> names;
    LogBlock data;
  };

  /// @return the names and data of largest().
  [[nodiscard]] Table take_largest(const std::string& path) &&;

 private:
  std::map<std::size_t, Table> tables_;  // one for each number of rows
};

}  // namespace axiscal
