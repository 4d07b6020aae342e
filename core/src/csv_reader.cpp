// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/csv_reader.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <unordered_set>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/missing_column.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Initial size of the buffer [bytes]: small, so that a short file uses few memory pages.
constexpr std::size_t first_size = 1U << 13U;
constexpr std::size_t block_size = 1U << 18U;  // usual size of the buffer [bytes]

bool is_blank(std::string_view text) {
  return text.find_first_not_of(" \t\r") == std::string_view::npos;
}

}  // namespace

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) {
    return text;
  }
  std::string cell = "\"";
  for (const char c : text) {
    cell += c == '"' ? "\"\"" : std::string(1, c);
  }
  return cell + '"';
}

bool is_utf8(std::string_view text) noexcept {
  std::size_t i = 0;
  while (i < text.size()) {
    std::uint64_t eight = 0;
    if (i + sizeof eight <= text.size()) {
      std::memcpy(&eight, text.data() + i, sizeof eight);
      if ((eight & 0x8080808080808080U) == 0) {
        i += sizeof eight;
        continue;
      }
    }
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
    const unsigned lead = byte(i);
    const std::size_t length = lead < 0x80                    ? 1
                               : lead >= 0xC2 && lead <= 0xDF ? 2
                               : lead >= 0xE0 && lead <= 0xEF ? 3
                               : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                              : 0;
    if (length == 0 || i + length > text.size()) {
      return false;
    }
    for (std::size_t k = 1; k < length; ++k) {
      if ((byte(i + k) & 0xC0U) != 0x80U) {
        return false;
      }
    }
    // Rejects overlong forms, surrogates and code points beyond U+10FFFF.
    if ((lead == 0xE0 && byte(i + 1) < 0xA0) || (lead == 0xED && byte(i + 1) > 0x9F) ||
        (lead == 0xF0 && byte(i + 1) < 0x90) || (lead == 0xF4 && byte(i + 1) > 0x8F)) {
      return false;
    }
    i += length;
  }
  return true;
}

CsvReader::CsvReader(Source source, std::string path, Quotes quotes)
    : source_(std::move(source)), path_(std::move(path)), quotes_(quotes), buffer_(first_size) {
  read_header();
}

CsvReader::CsvReader(Source source,
                     std::string path,
                     std::vector<std::string> header,
                     Quotes quotes)
    : source_(std::move(source)),
      path_(std::move(path)),
      quotes_(quotes),
      buffer_(first_size),
      header_(std::move(header)) {
  for (const std::string& name : header_) {
    header_text_ += (header_text_.empty() ? "" : ",") + csv_cell(name);
  }
}

CsvReader::CsvReader(const CsvReader& of, Lines lines)
    : path_(of.path_),
      quotes_(Quotes::end_with_line),
      buffer_(std::move(lines.text)),
      filled_(buffer_.size()),
      at_end_(true),
      next_line_(lines.first_line),
      header_(of.header_),
      header_text_(of.header_text_) {}

void CsvReader::rename(std::vector<std::string> header) {
  if (header.size() != header_.size()) {
    throw DomainError(
        formatted("CsvReader: {} names are given for {} columns", header.size(), header_.size()));
  }
  header_ = std::move(header);
}

std::optional<std::size_t> CsvReader::column(std::string_view name) const {
  const auto found = std::find(header_.begin(), header_.end(), name);
  if (found == header_.end()) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(found - header_.begin());
}

std::size_t CsvReader::need(const std::string& name) const {
  const std::optional<std::size_t> place = column(name);
  if (!place) {
    throw MissingColumnError(path_, line_, name, header_);
  }
  return *place;
}

// Finds the end of the line that contains the offset `from`, and reads more bytes if needed.
// Offsets are relative to begin_. Reading more bytes sets begin_ to 0.
bool CsvReader::find_line_end(std::size_t from, std::size_t& end) {
  std::size_t searched = from;  // start of the next search; may be one past the end
  const auto check_length = [&](std::size_t length) {
    if (length > longest_row) {
      throw DataError(path_, next_line_, "a row of more than 1 MiB: is this a text file?");
    }
  };
  for (;;) {
    const std::size_t available = filled_ - begin_;
    if (searched < available) {
      const char* start = buffer_.data() + begin_ + searched;
      if (const void* newline = std::memchr(start, '\n', available - searched)) {
        end = static_cast<std::size_t>(static_cast<const char*>(newline) - buffer_.data()) - begin_;
        check_length(end);
        return true;
      }
      searched = available;
    }
    if (at_end_) {
      end = available;
      return available > from;
    }
    check_length(searched);
    read_more();
  }
}

// Moves the unread bytes to the front of the buffer and reads more bytes. The buffer doubles if it
// is full. It also doubles if it is more than half full and smaller than a block.
void CsvReader::read_more() {
  const bool may_be_long = buffer_.size() < block_size && filled_ > buffer_.size() / 2;
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, filled_ - begin_);
    filled_ -= begin_;
    begin_ = 0;
  }
  if (filled_ == buffer_.size() || may_be_long) {
    buffer_.resize(2 * buffer_.size());
  }
  const std::size_t count = source_(buffer_.data() + filled_, buffer_.size() - filled_);
  filled_ += count;
  at_end_ = count == 0;
}

std::optional<CsvReader::Lines> CsvReader::take_lines() {
  begin_ += std::exchange(consumed_, 0);
  std::size_t end = 0;
  if (!find_line_end(0, end)) {
    return std::nullopt;
  }
  while (!at_end_ && filled_ - begin_ < block_size) {
    read_more();
  }
  const char* const from = buffer_.data() + begin_;
  std::string_view lines(from, filled_ - begin_);
  const std::size_t quote = lines.find('"');
  if (quote != std::string_view::npos || !at_end_) {
    lines = lines.substr(0, quote);
    lines = lines.substr(0, lines.rfind('\n') + 1);
  }
  constexpr std::size_t worth_it = block_size / 4;
  if (lines.empty() || (quote != std::string_view::npos && lines.size() < worth_it)) {
    return std::nullopt;
  }
  Lines taken{.text = std::vector<char>(lines.begin(), lines.end()), .first_line = next_line_};
  next_line_ += static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n'));
  consumed_ = lines.size();
  return taken;
}

// Sets text_ to the next line that is neither empty nor a comment.
bool CsvReader::next_content_line() {
  for (;;) {
    begin_ += consumed_;
    consumed_ = 0;
    if (!find_line_end(0, row_end_)) {
      return false;
    }
    line_ = next_line_++;
    consumed_ = std::min(row_end_ + 1, filled_ - begin_);
    text_ = without_returns(std::string_view(buffer_.data() + begin_, row_end_));
    if (!text_.empty() && text_.front() != '#' && !is_blank(text_)) {
      return true;
    }
  }
}

bool CsvReader::split_plain() {
  cells_.clear();
  std::string_view rest = text_;
  for (;;) {
    const std::size_t comma = rest.find(',');
    cells_.push_back(trimmed(rest.substr(0, comma)));
    if (comma == std::string_view::npos) {
      return true;
    }
    rest.remove_prefix(comma + 1);
  }
}

// Appends the text between two quotes to unquoted_. On entry, `i` is the position after the opening
// quote; on return, it is the position after the closing quote. Returns false if there is no
// closing quote.
bool CsvReader::unquote(std::size_t& i) {
  const auto at = [&](std::size_t k) { return buffer_[begin_ + k]; };
  for (;;) {
    if (i == row_end_) {  // the cell goes on in the next line
      std::size_t longer = 0;
      if (quotes_ == Quotes::end_with_line || row_end_ > longest_row ||
          !find_line_end(row_end_ + 1, longer)) {
        return false;
      }
      row_end_ = longer;
      consumed_ = std::min(row_end_ + 1, filled_ - begin_);
      ++next_line_;
      unquoted_ += '\n';
      ++i;
    } else if (at(i) != '"') {
      unquoted_ += at(i++);
    } else if (i + 1 < row_end_ && at(i + 1) == '"') {
      unquoted_ += '"';
      i += 2;
    } else {
      ++i;
      return true;
    }
  }
}

// Splits a row that contains quotes. It may span several lines.
bool CsvReader::split_quoted() {
  const std::size_t first_line_end = row_end_;
  const std::size_t first_consumed = consumed_;
  const std::size_t first_next_line = next_line_;
  const auto give_up = [&](std::string_view reason) {
    row_end_ = first_line_end;
    consumed_ = first_consumed;
    next_line_ = first_next_line;
    defect_ = reason;
    text_ = without_returns(std::string_view(buffer_.data() + begin_, row_end_));
    split_plain();
    return false;
  };
  pieces_.clear();
  unquoted_.clear();
  std::size_t i = 0;
  for (;;) {
    const auto at = [&](std::size_t k) { return buffer_[begin_ + k]; };
    const std::size_t piece = unquoted_.size();
    while (i < row_end_ && (at(i) == ' ' || at(i) == '\t')) {
      ++i;
    }
    if (i < row_end_ && at(i) == '"') {
      if (!unquote(++i)) {
        return give_up("a cell begins with a quote and lacks the closing quote");
      }
      while (i < row_end_ && (at(i) == ' ' || at(i) == '\t' || at(i) == '\r')) {
        ++i;
      }
      if (i < row_end_ && at(i) != ',') {
        return give_up("text follows the closing quote of a cell");
      }
      pieces_.emplace_back(piece, unquoted_.size() - piece);
    } else {
      while (i < row_end_ && at(i) != ',') {
        unquoted_ += at(i++);
      }
      std::string_view cell(unquoted_.data() + piece, unquoted_.size() - piece);
      if (i == row_end_) {
        cell = without_returns(cell);
      }
      pieces_.emplace_back(piece, trimmed(cell).size());
    }
    if (i == row_end_) {
      break;
    }
    ++i;  // the comma
  }
  cells_.clear();
  for (const auto& [start, length] : pieces_) {
    cells_.emplace_back(unquoted_.data() + start, length);
  }
  text_ = without_returns(std::string_view(buffer_.data() + begin_, row_end_));
  return true;
}

CsvReader::Row CsvReader::next() {
  if (!next_content_line()) {
    text_ = {};
    cells_.clear();
    return Row::end;
  }
  if (std::memchr(text_.data(), '\0', text_.size()) != nullptr) {
    split_plain();
    defect_ = "a NUL byte: the file is damaged or not a text file";
    return Row::defective;
  }
  const bool quoted = std::memchr(text_.data(), '"', text_.size()) != nullptr;
  if (!(quoted ? split_quoted() : split_plain())) {
    return Row::defective;
  }
  if (cells_.size() != header_.size() && !header_.empty()) {
    defect_ =
        formatted("the row has {} cells, but the header has {}", cells_.size(), header_.size());
    return Row::defective;
  }
  return Row::good;
}

void CsvReader::read_header() {
  std::size_t end = 0;
  const bool any = find_line_end(0, end);
  const std::string_view start(buffer_.data(), any ? std::min<std::size_t>(end + 1, filled_) : 0);
  if (start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF")) {
    throw DataError(path_, 1, "UTF-16 text: save the file as UTF-8");
  }
  if (start.starts_with("\xEF\xBB\xBF")) {
    begin_ = 3;
  }
  const Row row = any ? next() : Row::end;
  if (row == Row::end) {
    throw DataError(path_, 1, "the file is empty: a header row and readings are needed");
  }
  if (!is_utf8(text_) || text_.find('\0') != std::string_view::npos) {
    throw DataError(path_, line_, "not UTF-8 text: save the table as CSV in UTF-8");
  }
  if (row == Row::defective) {
    throw DataError(path_, line_, defect_);
  }
  header_text_ = text_;
  header_.assign(cells_.begin(), cells_.end());
  std::unordered_set<std::string_view> seen;
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (header_[i].empty() && header_.size() > 1) {
      throw DataError(path_, line_, formatted("column {} lacks a name", i + 1));
    }
    if (!seen.insert(header_[i]).second) {
      throw DataError(path_, line_, formatted("column '{}': occurs twice", header_[i]));
    }
  }
}

}  // namespace axiscal
