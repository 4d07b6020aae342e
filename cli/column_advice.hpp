// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/missing_column.hpp"

namespace axiscal::cli {

/// @param error   the missing column, and the existing ones.
/// @param option  that states columns: "--axes".
/// @param word    what the columns of the instrument have in their names: "acc"; may be empty.
/// @return a message with the line in question, and a mark under the cell: `PATH:LINE: column 'x':
///         ...`, if the file can be read.
[[nodiscard]] std::string with_marked_cell(const std::string& message);

/// @return "; try --axes acc_x,acc_y,acc_z", where the table has three columns that differ in their
///         letter x, y, z only, first those with the word; else empty.
[[nodiscard]] std::string column_advice(const MissingColumnError& error,
                                        std::string_view option,
                                        std::string_view word);

/// Does some work; where a column is missing its error ends with the option that would name it.
template <typename Work>
auto with_column_advice(std::string_view option, std::string_view word, const Work& work) {
  try {
    return work();
  } catch (const MissingColumnError& error) {
    throw error.with(column_advice(error, option, word));
  }
}

}  // namespace axiscal::cli
