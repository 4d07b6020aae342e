// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// @param read  gives the next bytes, at most so many; 0 at the end.
/// @return the next `size` bytes, or fewer where the end comes first. The memory grows with what is
///         there, not with what is asked for.
[[nodiscard]] std::string read_up_to(
    std::size_t size, const std::function<std::size_t(char* buffer, std::size_t size)>& read);

/// The bytes of a file, unpacked where it is compressed.
class ByteSource {
 public:
  /// @throws DataError  as InputFile; or if it is compressed and this build cannot unpack it.
  explicit ByteSource(const std::string& path);

  /// Bytes that come from elsewhere: a part of an archive, say.
  /// @param path  for messages.
  /// @param read  gives the next bytes, at most so many; 0 at the end.
  ByteSource(std::string path, std::function<std::size_t(char* buffer, std::size_t size)> read);

  ~ByteSource();
  ByteSource(ByteSource&&) noexcept;
  ByteSource& operator=(ByteSource&&) noexcept;

  /// @return the first bytes, at most `size`, which read() gives once more.
  [[nodiscard]] std::string_view peek(std::size_t size);

  /// @return how many bytes were read, at most `size`; 0 at the end.
  /// @throws DataError  if reading or unpacking fails.
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size);

  [[nodiscard]] const std::string& path() const { return path_; }

  /// @return "gzip", ..., or empty.
  [[nodiscard]] const std::string& compression() const { return compression_; }

 private:
  struct Reader;
  std::string path_;
  std::string compression_;
  std::unique_ptr<Reader> reader_;
  std::vector<char> ahead_;  // read and not yet handed on
  std::size_t next_ = 0;     // in it
};

}  // namespace axiscal
