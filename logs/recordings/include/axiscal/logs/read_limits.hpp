// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace axiscal {

/// A cost of reading a file.
enum class ReadCost {
  nesting,   ///< archives and compressed files within each other
  members,   ///< files in an archive
  unpacked,  ///< bytes that come out of compressed ones
  cells,     ///< numbers and words created from the file
  steps,     ///< repetitions that do not need further bytes of the file
  memory,    ///< bytes that are held at once
  disk       ///< bytes of temporary copies
};

/// The most that a file may cost. Unless it is set, a limit grows with the size of the file; real
/// recordings stay ten times below. A file that was made to exhaust the reader does not.
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

  /// @param file_size  bytes of the file that are known so far.
  [[nodiscard]] double of(ReadCost cost, double file_size) const;

  static constexpr std::size_t count = 7;

 private:
  std::array<std::optional<double>, count> set_;
};

/// @return the limits' names, in the order of ReadCost.
[[nodiscard]] std::span<const std::string_view> read_limit_names();

}  // namespace axiscal
