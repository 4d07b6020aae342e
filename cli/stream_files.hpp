// SPDX-License-Identifier: Apache-2.0
// Files to which lines are appended: records (.jsonl, .jsonl.zst) and tables (.csv) of many units.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "axiscal/calib/study.hpp"

namespace axiscal::cli {

/// @return the 64-bit FNV-1a hash of a text.
[[nodiscard]] std::uint64_t hash_of(std::string_view text);

/// @return true if a unit belongs to a shard. This holds if hash_of() of the serial number, modulo
///         the number of shards, equals the shard's number minus 1.
[[nodiscard]] bool is_in_shard(const Shard& shard, std::string_view serial);

/// @return the shard in the value of an option, `I/N`.
/// @throws UsageError  if the text has another form, or I is not from 1 to N.
[[nodiscard]] Shard shard_of_option(const std::string& text);

/// Function that is called for each line of a file in order, without the line end. If it returns
/// false, reading stops.
using TakeLine = std::function<bool(std::string_view line)>;

/// Reads the complete lines of a file. It ignores a last line without a line end and a damaged
/// frame of a .zst file, because a process that was killed leaves such ends.
/// @return the number of bytes of the file up to the end of the last line for which `take` returned
///         true.
/// @throws DataError  if the file cannot be read.
std::size_t read_complete_lines(const std::string& path, const TakeLine& take);

/// Appends lines to a file, compressed if the name ends in .zst. After write() has returned, the
/// lines are in the file. There is no fsync, so they may not be on the disk yet.
class LineFile {
 public:
  /// @param keep  number of bytes at the start of an existing file that are kept; the rest is
  ///              removed.
  /// @throws OutputError  if the file cannot be written; UsageError if this build lacks zstd.
  LineFile(std::string path, std::size_t keep);
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;

  /// @throws OutputError  if the file cannot be written, for example because the disk is full.
  void write(std::string_view lines);

 private:
  std::string path_;
  bool compressed_ = false;
  int descriptor_ = -1;
};

}  // namespace axiscal::cli
