// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "core/own_program.hpp"
#include "logs/recordings/src/log_source.hpp"

namespace axiscal {

inline constexpr OwnProgram reader_program{.name = "axiscal-read", .package = "axiscal-hdf5"};

/// Reads a file by the program axiscal-read (logs/reader), whose libraries are not safe with
/// damaged files. The program answers or dies, and its memory and time are limited.
///
/// @param path    of the file, as this process opens it.
/// @param name    of the file, for messages.
/// @param format  "mat73" or "hdf5".
/// @return the table that has the most numbers.
/// @throws DataError   if the file is damaged.
/// @throws LimitError  if it costs more than it may.
/// @throws RefusedError  if the program is not installed.
[[nodiscard]] std::unique_ptr<LogFile::Source> read_in_another_process(const std::string& path,
                                                                       const std::string& name,
                                                                       const char* format,
                                                                       const ReadBudget& budget);

/// The exit status of that program.
enum ReaderStatus : int { reader_answered = 0, reader_failed = 1, reader_lacks_memory = 2 };

}  // namespace axiscal
