// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// A table that lacks a column. The message lists the existing columns.
class AXISCAL_EXPORT MissingColumnError : public DataError {
 public:
  /// Message `PATH:LINE: column 'NAME': is missing; the columns are: ...`. If the header is one
  /// cell that contains semicolons or tabs, the message begins with the remark that commas are
  /// needed.
  ///
  /// @param path     path of the table.
  /// @param line     line number of the header, from 1; 0 if it is unknown.
  /// @param column   name of the missing column.
  /// @param columns  names of the existing columns.
  MissingColumnError(const std::string& path,
                     std::size_t line,
                     std::string column,
                     std::vector<std::string> columns);

  /// @return an error with the same message, followed by `words`.
  [[nodiscard]] DataError with(const std::string& words) const;

  [[nodiscard]] const std::string& column() const { return column_; }
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }

 private:
  std::string place_;
  std::string column_;
  std::vector<std::string> columns_;
};

}  // namespace axiscal
