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

/// @return FNV-1a (64 bits) of a text.
[[nodiscard]] std::uint64_t hash_of(std::string_view text);

/// @return true if a unit belongs to a shard: hash_of() of its serial number, modulo the number of
///         shards, equals the shard's number minus 1.
[[nodiscard]] bool is_in_shard(const Shard& shard, std::string_view serial);

/// @return the shard of an option `I/N`.
/// @throws UsageError  if the text is not of this form, or I is not from 1 to N.
[[nodiscard]] Shard shard_of_option(const std::string& text);

/// Called for each line of a file, in order, without the line end. Returns false to stop reading.
using TakeLine = std::function<bool(std::string_view line)>;

/// Reads the complete lines of a file. A last line without a line end, or a damaged frame of a .zst
/// file, was written by a process that was killed, and is left out.
/// @return the number of bytes of the file up to the end of the last line for which `take` returned
///         true.
/// @throws DataError  if the file cannot be read.
std::size_t read_complete_lines(const std::string& path, const TakeLine& take);

/// Appends lines to a file, compressed if its name ends in .zst. After write() returns, the lines
/// are in the file, but may not be on the disk yet, because there is no fsync.
class LineFile {
 public:
  /// @param keep  number of bytes of an existing file that are kept; the rest is removed.
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
