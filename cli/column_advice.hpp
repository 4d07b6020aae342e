// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/core/missing_column.hpp"

namespace axiscal::cli {

/// Appends the text of line LINE of the file to a message `PATH:LINE: column 'x': ...`. The cell of
/// the column is marked in the appended text.
/// @return the extended message. If the message has another form, or the file cannot be read again,
///         it is returned unchanged.
[[nodiscard]] std::string with_marked_cell(const std::string& message);

/// Looks for three columns whose names differ only in one letter, which is x, y or z. Columns whose
/// names contain `word` are preferred.
/// @param error   error with the names of the missing column and of the existing columns.
/// @param option  name of the option that states the columns, for example "--axes".
/// @param word    word that the names of the columns usually contain, for example "acc"; may be
///                empty.
/// @return a text such as "; try --axes acc_x,acc_y,acc_z"; empty if there are no such columns.
[[nodiscard]] std::string column_advice(const MissingColumnError& error,
                                        std::string_view option,
                                        std::string_view word);

/// Calls `work`. If it throws MissingColumnError, column_advice() is added to the message.
template <typename Work>
auto with_column_advice(std::string_view option, std::string_view word, const Work& work) {
  try {
    return work();
  } catch (const MissingColumnError& error) {
    throw error.with(column_advice(error, option, word));
  }
}

}  // namespace axiscal::cli
