// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/series_tables.hpp"

namespace axiscal {

/// Reads a file in a program of its own, by a library that is not safe with damaged files. The
/// program answers or dies, and its memory and time are limited.
///
/// @param path    of the file, as this process opens it.
/// @param name    of the file, for messages.
/// @param format  "mat73" or "hdf5".
/// @return the table that has the most numbers.
/// @throws DataError   if the file is no file, or damaged.
/// @throws LimitError  if it costs more than it may.
[[nodiscard]] std::unique_ptr<LogFile::Source> read_in_another_process(const std::string& path,
                                                                       const std::string& name,
                                                                       const char* format,
                                                                       const ReadBudget& budget);

/// The main function of that program: reads the file that is standard input, and writes the answer
/// to standard output.
/// @param arguments  FORMAT, bytes of address space, seconds of the processor.
int answer_as_other_process(int count, char** arguments);

/// The readers: each throws an Error that says what is wrong, without the path.
[[nodiscard]] SeriesTables read_mat73(const std::string& path);
[[nodiscard]] SeriesTables read_hdf5(const std::string& path);

/// @throws Error  if a dataset of an HDF5 file keeps its numbers in another file.
void refuse_foreign_storage(const std::string& path);

}  // namespace axiscal
