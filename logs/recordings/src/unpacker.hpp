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

/// A compressed stream is damaged; the message says why.
class DamagedStream : public Error {
 public:
  using Error::Error;
};

/// The content of a compressed stream, unpacked as it is read. Streams that stand one after another
/// are one content.
class Unpacker {
 public:
  /// Gives the next packed bytes, at most `size`; 0 at the end.
  using Read = std::function<std::size_t(char* buffer, std::size_t size)>;

  /// @param packing  "gzip", "zlib", "bzip2", "xz", "lzip", "zstd" or "lz4" (frames).
  /// @throws Error  if this build cannot unpack it; the message starts with "is compressed".
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

/// @return the packing of a file that starts so; empty if it is not compressed.
[[nodiscard]] std::string_view detect_compression(std::string_view start);

/// Unpacks a block of a bag, which is held whole.
/// @param packing  as of Unpacker.
/// @param size     of the content, as stated by the file.
/// @return nullopt if the block is damaged, or its content has another size.
/// @throws LimitError  if the content is more than the file may cost.
/// @throws Error       if this build cannot unpack it.
[[nodiscard]] std::optional<std::string> unpack(std::string_view packing,
                                                std::string_view block,
                                                std::size_t size,
                                                const ReadBudget& budget);

/// Unpacks a zstd frame that states the size of its content.
[[nodiscard]] std::optional<std::string> unpack_zstd(std::string_view block,
                                                     const ReadBudget& budget);

}  // namespace axiscal
