// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/text_encoding.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "axiscal/core/csv_reader.hpp"
#include "logs/recordings/src/line_stream.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

void append_utf8(char32_t c, std::string& text) {
  const auto put = [&](char32_t byte) { text += static_cast<char>(byte); };
  if (c < 0x80) {
    put(c);
  } else if (c < 0x800) {
    put(0xC0U | c >> 6U);
    put(0x80U | (c & 0x3FU));
  } else if (c < 0x10000) {
    put(0xE0U | c >> 12U);
    put(0x80U | (c >> 6U & 0x3FU));
    put(0x80U | (c & 0x3FU));
  } else {
    put(0xF0U | c >> 18U);
    put(0x80U | (c >> 12U & 0x3FU));
    put(0x80U | (c >> 6U & 0x3FU));
    put(0x80U | (c & 0x3FU));
  }
}

// Converts UTF-16 to UTF-8 piece by piece.
class Utf16Reader {
 public:
  Utf16Reader(ByteSource bytes, bool is_big) : bytes_(std::move(bytes)), is_big_(is_big) {}

  std::size_t read(char* buffer, std::size_t size) {
    while (ready_.size() - given_ == 0) {
      if (!convert()) {
        return 0;
      }
    }
    const std::size_t count = ready_.copy(buffer, size, given_);
    given_ += count;
    return count;
  }

 private:
  bool convert() {
    ready_.clear();
    given_ = 0;
    std::array<char, 8192> raw{};
    std::size_t filled = left_.copy(raw.data(), left_.size());
    while (filled < raw.size()) {
      const std::size_t count = bytes_.read(raw.data() + filled, raw.size() - filled);
      if (count == 0) {
        break;
      }
      filled += count;
    }
    left_.clear();
    const auto unit = [&](std::size_t at) {
      const auto first = static_cast<unsigned char>(raw[at]);
      const auto second = static_cast<unsigned char>(raw[at + 1]);
      return static_cast<char32_t>(is_big_ ? first << 8U | second : second << 8U | first);
    };
    std::size_t at = 0;
    while (at + 1 < filled) {
      char32_t c = unit(at);
      if (c >= 0xD800 && c < 0xDC00) {  // first half of a surrogate pair
        if (at + 3 >= filled) {
          if (filled == raw.size()) {
            left_.assign(raw.data() + at, filled - at);
          }
          break;
        }
        const char32_t low = unit(at + 2);
        c = 0x10000 + ((c - 0xD800) << 10U) + (low >= 0xDC00 && low < 0xE000 ? low - 0xDC00 : 0);
        at += 2;
      }
      at += 2;
      append_utf8(c, ready_);
    }
    return filled > 0;
  }

  ByteSource bytes_;
  bool is_big_;
  std::string left_;
  std::string ready_;
  std::size_t given_ = 0;
};

// Replaces carriage returns by line feeds if each line ends with a carriage return alone.
ByteSource with_line_feeds(ByteSource bytes) {
  const std::string_view start = bytes.peek(layout_bytes);
  std::size_t alone = 0;  // carriage returns without a line feed next to them
  for (std::size_t at = start.find('\r'); at != std::string_view::npos;
       at = start.find('\r', at + 1)) {
    const bool follows = at > 0 && (start[at - 1] == '\n' || start[at - 1] == '\r');
    const bool leads = at + 1 < start.size() && (start[at + 1] == '\n' || start[at + 1] == '\r');
    alone += follows || leads ? 0U : 1U;
  }
  const auto feeds = static_cast<std::size_t>(std::count(start.begin(), start.end(), '\n'));
  if (alone == 0 || alone <= 2 * feeds || start.find('\0') != std::string_view::npos) {
    return bytes;
  }
  auto shared = std::make_shared<ByteSource>(std::move(bytes));
  return {shared->path(),
          [shared](char* buffer, std::size_t size) {
            const std::size_t count = shared->read(buffer, size);
            std::replace(buffer, buffer + count, '\r', '\n');
            return count;
          },
          shared->budget()};
}

// Replaces typographic blanks and minus signs, which some spreadsheets write in numbers.
ByteSource with_plain_signs(ByteSource bytes) {
  struct Sign {
    std::string_view typeset;
    char plain;
  };
  constexpr std::array<Sign, 5> signs = {{{"\xE2\x80\x89", ' '},
                                          {"\xE2\x80\xAF", ' '},
                                          {"\xE2\x80\x87", ' '},
                                          {"\xC2\xA0", ' '},
                                          {"\xE2\x88\x92", '-'}}};
  const std::string_view start = bytes.peek(layout_bytes);
  const bool has_any = start.find('\0') == std::string_view::npos &&
                       std::any_of(signs.begin(), signs.end(), [&](const Sign& sign) {
                         return start.find(sign.typeset) != std::string_view::npos;
                       });
  if (!has_any) {
    return bytes;
  }
  return converted_lines(std::move(bytes), [signs](std::string_view line, std::string& text) {
    text.assign(line);
    text += '\n';
    for (const Sign& sign : signs) {
      for (std::size_t at = text.find(sign.typeset); at != std::string::npos;
           at = text.find(sign.typeset, at)) {
        text.replace(at, sign.typeset.size(), 1, sign.plain);
      }
    }
  });
}

}  // namespace

ByteSource as_utf8(ByteSource bytes) {
  const std::string_view start = bytes.peek(4);
  const bool is_little = start.starts_with("\xFF\xFE");
  const bool is_big = start.starts_with("\xFE\xFF");
  // Without a byte order mark, UTF-16 is recognised if the first two characters are ASCII.
  const bool looks_little =
      start.size() >= 4 && start[0] > 0 && start[1] == '\0' && start[2] > 0 && start[3] == '\0';
  const bool looks_big =
      start.size() >= 4 && start[0] == '\0' && start[1] > 0 && start[2] == '\0' && start[3] > 0;
  if (!is_little && !is_big && !looks_little && !looks_big) {
    return with_plain_signs(with_line_feeds(std::move(bytes)));
  }
  if (is_little || is_big) {
    std::array<char, 2> mark{};
    static_cast<void>(bytes.read(mark.data(), mark.size()));
  }
  const std::string path = bytes.path();
  const ReadBudget budget = bytes.budget();
  auto reader = std::make_shared<Utf16Reader>(std::move(bytes), is_big || looks_big);
  return {path, [reader](char* buffer, std::size_t size) { return reader->read(buffer, size); },
          budget};
}

std::string utf8_of_latin1(std::string_view text) {
  if (is_utf8(text)) {
    return std::string(text);
  }
  std::string converted;
  for (const char c : text) {
    append_utf8(static_cast<unsigned char>(c), converted);
  }
  return converted;
}

}  // namespace axiscal
