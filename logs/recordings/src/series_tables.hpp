// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "logs/recordings/src/log_source.hpp"

namespace axiscal {

/// Tables that are made from the numeric variables of a file. Variables with the same number of
/// rows form one table.
class SeriesTables {
 public:
  /// Adds a variable of rows x columns numbers. If it has fewer rows than columns, it is
  /// transposed.
  /// @param values  the numbers, column by column.
  void add(const std::string& name,
           std::size_t rows,
           std::size_t columns,
           const std::vector<double>& values);

  /// @return the table with the largest number of values.
  /// @throws DataError  if there is no table with more than one row.
  [[nodiscard]] std::unique_ptr<LogFile::Source> largest(const std::string& path) &&;

  struct Table {
    std::vector<std::string> names;
    LogBlock data;
  };

  /// @return the same table as largest(), as names and data.
  [[nodiscard]] Table take_largest(const std::string& path) &&;

 private:
  std::map<std::size_t, Table> tables_;  // tables by their number of rows
};

}  // namespace axiscal
