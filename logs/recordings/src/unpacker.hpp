// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "axiscal/core/error.hpp"
#include "logs/recordings/src/read_budget.hpp"

namespace axiscal {

/// Thrown if a compressed stream is damaged. The message states the reason.
class DamagedStream : public Error {
 public:
  using Error::Error;
};

/// Unpacks compressed data as they are read. If the data consist of several compressed streams,
/// their contents are joined.
class Unpacker {
 public:
  /// A function that writes the next compressed bytes to `buffer`, at most `size` of them, and
  /// returns their number; 0 at the end.
  using Read = std::function<std::size_t(char* buffer, std::size_t size)>;

  /// @param packing  kind of compression: "gzip", "zlib", "bzip2", "xz", "lzip", "zstd" or "lz4"
  ///                 (frame format).
  /// @param packed   gives the compressed bytes.
  /// @throws Error  if this build cannot unpack `packing`; the message starts with "is compressed".
  Unpacker(std::string_view packing, Read packed);
  ~Unpacker();
  Unpacker(Unpacker&&) noexcept;
  Unpacker& operator=(Unpacker&&) noexcept;

  /// @return the number of bytes written into `buffer`, at most `size`; 0 at the end.
  /// @throws DamagedStream
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// @param start  the first bytes of a file.
/// @return the kind of compression of the file, such as "gzip"; empty if not compressed.
[[nodiscard]] std::string_view detect_compression(std::string_view start);

/// Unpacks a compressed block of a ROS bag in memory.
/// @param packing  kind of compression; see Unpacker.
/// @param size     size of the unpacked content, as stated in the file [bytes].
/// @return the content; nullopt if the block is damaged, or its content has another size.
/// @throws LimitError  if unpacking would exceed a limit in `budget`.
/// @throws Error       if this build cannot unpack `packing`.
[[nodiscard]] std::optional<std::string> unpack(std::string_view packing,
                                                std::string_view block,
                                                std::size_t size,
                                                const ReadBudget& budget);

/// Unpacks a zstd frame that states the size of its content.
/// @return the content; nullopt if the frame states no size, or is damaged.
[[nodiscard]] std::optional<std::string> unpack_zstd(std::string_view block,
                                                     const ReadBudget& budget);

}  // namespace axiscal
