// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "log_source.hpp"
#include "series_tables.hpp"

namespace axiscal {

/// Reads a file in a process of its own, by a library that is not safe with damaged files: what
/// happens there is an answer or none, and its memory is in proportion to the file.
///
/// @param read  throws an Error that says what is wrong, without the path.
/// @param name  of the file, for messages.
/// @param kind  of file, for messages: ".mat file".
/// @return the table that has the most numbers.
/// @throws DataError  if the file is no file, or damaged.
[[nodiscard]] std::unique_ptr<LogFile::Source> read_in_another_process(
    const std::string& path,
    const std::string& name,
    SeriesTables (*read)(const std::string& path),
    const char* kind);

}  // namespace axiscal
