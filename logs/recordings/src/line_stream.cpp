// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/line_stream.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {

bool LineStream::next(std::string_view& line) {
  std::size_t searched = begin_;
  const auto check_length = [&](std::size_t length) {
    if (length > longest_line) {
      throw DataError(bytes_.path(), line_ + 1, "a line of more than 1 MiB: is this a text file?");
    }
  };
  const auto hand_on = [&](std::size_t end) {
    check_length(end - begin_);
    line = without_returns(std::string_view(buffer_.data() + begin_, end - begin_));
    ++line_;
  };
  for (;;) {
    if (searched < filled_) {
      if (const void* newline = std::memchr(buffer_.data() + searched, '\n', filled_ - searched)) {
        const auto end =
            static_cast<std::size_t>(static_cast<const char*>(newline) - buffer_.data());
        hand_on(end);
        begin_ = end + 1;
        return true;
      }
      searched = filled_;
    }
    if (at_end_) {
      hand_on(filled_);
      begin_ = filled_;
      return !line.empty();
    }
    check_length(filled_ - begin_);
    if (begin_ > 0) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, filled_ - begin_);
      searched -= begin_;
      filled_ -= begin_;
      begin_ = 0;
    }
    if (filled_ == buffer_.size()) {
      buffer_.resize(2 * buffer_.size());
    }
    const std::size_t count = bytes_.read(buffer_.data() + filled_, buffer_.size() - filled_);
    filled_ += count;
    at_end_ = count == 0;
  }
}

std::vector<std::string_view> first_lines(std::string_view start, bool is_whole, std::size_t most) {
  std::vector<std::string_view> lines;
  std::size_t at = 0;
  while (at < start.size() && lines.size() < most) {
    const std::size_t end = start.find('\n', at);
    if (end == std::string_view::npos && !is_whole && !lines.empty()) {
      break;
    }
    lines.push_back(
        without_returns(start.substr(at, end == std::string_view::npos ? end : end - at)));
    at = end == std::string_view::npos ? start.size() : end + 1;
  }
  return lines;
}

bool are_most_lines(std::string_view start,
                    const std::function<bool(std::string_view line)>& is_such) {
  constexpr std::size_t looked_at = 20;
  const std::vector<std::string_view> lines = first_lines(start, false, looked_at);
  const auto good = std::count_if(lines.begin(), lines.end(), is_such);
  return good > 0 && 2 * good >= static_cast<std::ptrdiff_t>(lines.size());
}

ByteSource converted_lines(ByteSource bytes,
                           std::function<void(std::string_view line, std::string& text)> convert) {
  const std::string path = bytes.path();
  const ReadBudget budget = bytes.budget();
  auto lines = std::make_shared<LineStream>(std::move(bytes));
  return bytes_of_pieces(
      path,
      [lines, convert = std::move(convert)](std::string& text) {
        std::string_view line;
        const bool is_there = lines->next(line);
        if (is_there) {
          convert(line, text);
        }
        return is_there;
      },
      budget);
}

}  // namespace axiscal
