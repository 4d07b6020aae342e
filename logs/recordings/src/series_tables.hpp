// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "logs/recordings/src/log_source.hpp"

namespace axiscal {

/// The numeric variables of a file that has several: those of one number of rows are a table.
class SeriesTables {
 public:
  /// Adds a variable, R x C, column by column in `values`; a row vector is one column.
  void add(const std::string& name,
           std::size_t rows,
           std::size_t columns,
           const std::vector<double>& values);

  /// @return the table that has the most numbers.
  /// @throws DataError  if there is none.
  [[nodiscard]] std::unique_ptr<LogFile::Source> largest(const std::string& path) &&;

  struct Table {
    std::vector<std::string> names;
    LogBlock data;
  };

  /// The same as a table's parts.
  [[nodiscard]] Table take_largest(const std::string& path) &&;

 private:
  std::map<std::size_t, Table> tables_;  // one for each number of rows
};

}  // namespace axiscal
