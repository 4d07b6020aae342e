// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "logs/recordings/src/read_budget.hpp"

namespace axiscal {

/// @param read  writes the next bytes to `buffer`, at most `size` of them, and returns their
///              number; 0 at the end.
/// @return the next `size` bytes, or fewer at the end. The memory used depends on the number of
///         bytes read, not on `size`.
[[nodiscard]] std::string read_up_to(
    std::size_t size, const std::function<std::size_t(char* buffer, std::size_t size)>& read);

/// The bytes of a file. A compressed file is unpacked.
class ByteSource {
 public:
  using Read = std::function<std::size_t(char* buffer, std::size_t size)>;

  /// @throws DataError  for the same reasons as InputFile, or if this build cannot unpack the file.
  explicit ByteSource(const std::string& path, const ReadLimits& limits = {});

  /// Reads bytes from a function, for example those of a pipe.
  /// @param path  path or name of the source, for messages.
  /// @param read  writes the next bytes to `buffer`, at most `size` of them, and returns their
  ///              number; 0 at the end.
  ByteSource(const std::string& path, Read read, const ReadLimits& limits = {});

  /// Reads bytes that are derived from a file: a part of an archive, or text in another encoding.
  /// @param budget  budget for reading the file.
  ByteSource(std::string path, Read read, ReadBudget budget);

  ~ByteSource();
  ByteSource(ByteSource&&) noexcept;
  ByteSource& operator=(ByteSource&&) noexcept;

  /// @return the next bytes, at most `size`, without consuming them.
  [[nodiscard]] std::string_view peek(std::size_t size);

  /// @return the number of bytes read, at most `size`; 0 at the end.
  /// @throws DataError  if reading or unpacking fails.
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size);

  [[nodiscard]] const std::string& path() const { return path_; }

  /// @return true if the source returns the unchanged bytes of the regular file at path().
  [[nodiscard]] bool is_file() const { return is_file_; }

  /// @return the remaining budget for reading these bytes.
  [[nodiscard]] const ReadBudget& budget() const { return budget_; }

  /// @return "gzip", ...; empty if the bytes are not compressed.
  [[nodiscard]] const std::string& compression() const { return compression_; }

 private:
  struct Reader;
  struct Opened {
    Read read;
    ReadBudget budget;
    bool is_file = false;
  };

  ByteSource(std::string path, Opened opened);
  static Opened open_file(const std::string& path, const ReadLimits& limits);
  static Opened open_pipe(Read read, const ReadBudget& budget);
  std::size_t read_on(char* buffer, std::size_t size);

  std::string path_;
  std::string compression_;
  bool is_file_ = false;
  ReadBudget budget_;
  std::unique_ptr<Reader> reader_;
  std::vector<char> ahead_;  // bytes read by peek()
  std::size_t next_ = 0;     // position in ahead_ of the byte that read() returns next
};

/// @return a source of bytes that are generated piece by piece as they are read.
/// @param next    writes the next piece to `piece`, which is empty; returns false at the end.
/// @param budget  budget for reading the file from which the bytes are derived.
[[nodiscard]] ByteSource bytes_of_pieces(std::string path,
                                         std::function<bool(std::string& piece)> next,
                                         ReadBudget budget);

}  // namespace axiscal
