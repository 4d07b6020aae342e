// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace axiscal {

/// A kind of cost that reading a file causes.
enum class ReadCost {
  nesting,   ///< depth of archives and compressed files
  members,   ///< files in an archive
  unpacked,  ///< bytes unpacked from compressed data
  cells,     ///< numbers and words created from the file
  steps,     ///< iterations of loops that read no further bytes
  memory,    ///< bytes held in memory at once
  disk       ///< bytes of temporary copies
};

/// Limits on the costs of reading a file. A limit that is not set has a default; most defaults grow
/// with the size of the file. Real recordings cost at most a tenth of the defaults. The limits stop
/// files that were made to exhaust memory, disk space or time.
///
/// Example:
///
///     axiscal::LogFormat format;
///     format.limits.set(axiscal::ReadCost::memory, 8e9);
///     axiscal::LogFile log("recording.xlsx", format);
class ReadLimits {
 public:
  /// @throws DomainError  if the value is negative or NaN.
  void set(ReadCost cost, double most);

  /// @param file_size  size of the file in bytes. For a pipe, the number of bytes read so far.
  /// @return the limit of the cost.
  [[nodiscard]] double of(ReadCost cost, double file_size) const;

  static constexpr std::size_t count = 7;

 private:
  std::array<std::optional<double>, count> set_;
};

/// @return the limits' names, in the order of ReadCost.
[[nodiscard]] std::span<const std::string_view> read_limit_names();

}  // namespace axiscal
