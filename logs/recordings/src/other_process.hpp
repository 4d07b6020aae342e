// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "core/own_program.hpp"
#include "logs/recordings/src/log_source.hpp"

namespace axiscal {

inline constexpr OwnProgram reader_program{.name = "axiscal-read", .package = "axiscal-hdf5"};

/// Reads a file with the program axiscal-read (logs/reader). It runs as another process with
/// limited memory and time, because the libraries for these formats are not safe with damaged
/// files.
///
/// @param path    path at which the file can be opened; it may be a temporary copy.
/// @param name    original name of the file, for messages.
/// @param format  "mat73" or "hdf5".
/// @return the table with the most numbers in the file.
/// @throws DataError   if the file is damaged.
/// @throws LimitError  if reading the file would exceed a limit.
/// @throws RefusedError  if the program is not installed or cannot be started.
[[nodiscard]] std::unique_ptr<LogFile::Source> read_in_another_process(const std::string& path,
                                                                       const std::string& name,
                                                                       const char* format,
                                                                       const ReadBudget& budget);

/// The exit status of axiscal-read.
enum ReaderStatus : int { reader_answered = 0, reader_failed = 1, reader_lacks_memory = 2 };

}  // namespace axiscal
