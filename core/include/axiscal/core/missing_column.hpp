// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// A table that lacks a column; it says which there are.
class AXISCAL_EXPORT MissingColumnError : public DataError {
 public:
  /// Message `PATH:LINE: column 'NAME': is missing; the columns are: ...`. If the whole header is
  /// one column with semicolons or tabs, the message starts with that.
  ///
  /// @param path     of the table.
  /// @param line     of the header, from 1; 0: of no text.
  /// @param column   the one that is missing.
  /// @param columns  those that there are.
  MissingColumnError(const std::string& path,
                     std::size_t line,
                     std::string column,
                     std::vector<std::string> columns);

  /// @return the same complaint with words behind it.
  [[nodiscard]] DataError with(const std::string& words) const;

  [[nodiscard]] const std::string& column() const { return column_; }
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }

 private:
  std::string place_;
  std::string column_;
  std::vector<std::string> columns_;
};

}  // namespace axiscal
