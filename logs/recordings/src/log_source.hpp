// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/log_file.hpp"
#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// Base class for readers of tables of numbers. Each file format has its own reader.
class LogFile::Source {
 public:
  virtual ~Source() = default;
  virtual void select(const std::vector<std::size_t>& columns) = 0;
  [[nodiscard]] virtual std::size_t read(LogBlock& block, std::size_t most) = 0;

  std::vector<std::string> columns;
  std::vector<std::string> notes;
  LogDefects defects;
  std::size_t rows = 0;  ///< number of rows, if the header of the file states it; otherwise 0
  double rate_hz = 0.0;  ///< sample rate stated in the file [Hz]; 0 if not stated
  std::optional<std::size_t> clock;  ///< index of the column of dates or times of day
  std::vector<std::size_t> is_text;  ///< indices of the columns without numbers
};

/// @param names  names of the columns if the file has no header; may be empty.
[[nodiscard]] std::unique_ptr<LogFile::Source> open_text_log(ByteSource bytes,
                                                             const std::vector<std::string>& names);
[[nodiscard]] std::unique_ptr<LogFile::Source> open_npy_log(ByteSource bytes,
                                                            const std::vector<std::string>& names);
[[nodiscard]] std::unique_ptr<LogFile::Source> open_mat_log(ByteSource bytes);
/// @param path  path of a regular file; a pipe cannot be read.
/// @param name  name of the file, for messages.
[[nodiscard]] std::unique_ptr<LogFile::Source> open_mat73_log(const std::string& path,
                                                              const std::string& name,
                                                              const ReadBudget& budget);
[[nodiscard]] std::unique_ptr<LogFile::Source> open_hdf5_log(const std::string& path,
                                                             const std::string& name,
                                                             const ReadBudget& budget);

/// A log in memory.
class LogInMemory : public LogFile::Source {
 public:
  LogInMemory(std::vector<std::string> names, LogBlock data);
  void select(const std::vector<std::size_t>& columns) override;
  std::size_t read(LogBlock& block, std::size_t most) override;

 private:
  LogBlock data_;
  std::vector<std::size_t> selected_;
  std::size_t next_ = 0;
};

/// @return the names of the columns: `names`, or c1, c2, ... if `names` is empty.
/// @param path   path of the file, for the message.
/// @param count  number of columns.
/// @throws DataError  if the number of names is neither 0 nor `count`.
[[nodiscard]] std::vector<std::string> column_names(const std::string& path,
                                                    const std::vector<std::string>& names,
                                                    std::size_t count);

}  // namespace axiscal
