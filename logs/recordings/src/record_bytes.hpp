// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {

/// Reads the little-endian numbers of a record one after another. If a number lies beyond the end
/// of the record, it is returned as 0, and ok() becomes false.
class RecordBytes {
 public:
  explicit RecordBytes(std::string_view bytes) : bytes_(bytes) {}

  template <typename Number>
  Number take() {
    Number value{};
    if (left() < sizeof value) {
      fail();
      return value;
    }
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    if constexpr (std::endian::native == std::endian::big && sizeof value > 1) {
      auto raw = std::bit_cast<std::array<char, sizeof value>>(value);
      for (std::size_t i = 0; i < raw.size() / 2; ++i) {
        std::swap(raw[i], raw[raw.size() - 1 - i]);
      }
      value = std::bit_cast<Number>(raw);
    }
    return value;
  }

  std::string_view text(std::size_t size) {
    if (left() < size) {
      fail();
      return {};
    }
    const std::string_view part = bytes_.substr(at_, size);
    at_ += size;
    return part;
  }

  void skip(std::size_t size) { static_cast<void>(text(size)); }

  /// Skips bytes up to the next multiple of `size`, counted from `origin`.
  void align(std::size_t size, std::size_t origin) {
    const std::size_t over = (at_ - origin) % size;
    if (over != 0) {
      skip(size - over);
    }
  }

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] std::string_view rest() const { return bytes_.substr(at_); }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  void fail() {
    ok_ = false;
    at_ = bytes_.size();
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// Reads the records of a file.
class RecordStream {
 public:
  explicit RecordStream(ByteSource bytes) : bytes_(std::move(bytes)) {}

  /// @return the next `size` bytes, without consuming them; fewer at the end. The bytes are valid
  ///         until the next call. Memory use depends on the number of bytes read, not on `size`.
  [[nodiscard]] std::string_view peek(std::size_t size) {
    while (filled_ - begin_ < size && !ended_) {
      read_more(size);
    }
    return {buffer_.data() + begin_, std::min(size, filled_ - begin_)};
  }

  /// @return the next `size` bytes; fewer at the end. The bytes are valid until the next call.
  [[nodiscard]] std::string_view take(std::size_t size) {
    const std::string_view record = peek(size);
    begin_ += record.size();
    position_ += record.size();
    return record;
  }

  /// @return the number of skipped bytes, at most `size`.
  std::uint64_t skip(std::uint64_t size) {
    std::uint64_t done = 0;
    while (done < size) {
      const std::size_t count =
          take(static_cast<std::size_t>(std::min<std::uint64_t>(piece, size - done))).size();
      if (count == 0) {
        break;
      }
      done += count;
    }
    return done;
  }

  /// Skips at least one byte, up to the next occurrence of `start`, or to the end if there is none.
  /// @return the number of skipped bytes.
  std::uint64_t skip_to(std::string_view start) {
    std::uint64_t passed = 0;
    for (;;) {
      const std::string_view ahead = peek(piece);
      const std::size_t found = ahead.find(start, passed == 0 ? 1 : 0);
      if (found != std::string_view::npos) {
        return passed + skip(found);
      }
      if (ahead.size() < piece) {
        return passed + skip(ahead.size());
      }
      passed += skip(piece - start.size());
    }
  }

  /// @return true if there are no more bytes.
  [[nodiscard]] bool at_end() { return peek(1).empty(); }

  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] const std::string& path() const { return bytes_.path(); }
  [[nodiscard]] const ReadBudget& budget() const { return bytes_.budget(); }

 private:
  static constexpr std::size_t piece = 1U << 18U;

  void read_more(std::size_t wanted) {
    if (begin_ > 0) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, filled_ - begin_);
      filled_ -= begin_;
      begin_ = 0;
    }
    const std::size_t room = std::max(piece, std::min(wanted, 2 * filled_ + piece));
    if (buffer_.size() < room) {
      buffer_.resize(room);
    }
    const std::size_t count = bytes_.read(buffer_.data() + filled_, buffer_.size() - filled_);
    filled_ += count;
    ended_ = count == 0;
  }

  ByteSource bytes_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;   // position in buffer_ of the first byte that was not taken
  std::size_t filled_ = 0;  // number of bytes in buffer_
  bool ended_ = false;
  std::uint64_t position_ = 0;
};

}  // namespace axiscal
