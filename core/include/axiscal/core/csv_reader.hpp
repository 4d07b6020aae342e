// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/core/version.hpp"

namespace axiscal {

/// Reads comma-separated text row by row in constant memory: files larger than memory, pipes.
///
/// RFC 4180 with a header row, UTF-8 with or without byte order mark, LF or CRLF; lines that start
/// with `#` and empty lines are skipped, blanks around a cell too. Reading a row allocates nothing
/// once the buffers have grown to the longest row.
class AXISCAL_EXPORT CsvReader {
 public:
  /// Gives the next bytes: fills at most `size` and returns how many; 0 at the end.
  using Source = std::function<std::size_t(char* buffer, std::size_t size)>;

  enum class Row { good, defective, end };

  /// A quoted cell may continue in the next line, or it must end with the line. The latter suits
  /// rows that must be delivered at once, because one stray quote would hold back all further rows.
  enum class Quotes { span_lines, end_with_line };

  /// Whole lines, as they stand in the file.
  struct Lines {
    std::vector<char> text;
    std::size_t first_line = 0;  ///< its number
  };

  /// A row longer than this is an error: whatever it is, it is not text of readings.
  static constexpr std::size_t longest_row = 1U << 20U;

  /// Reads the header.
  ///
  /// @param source  where the bytes come from.
  /// @param path    the file's name for messages.
  /// @param quotes  as above.
  /// @throws DataError  if the text is empty, is UTF-16 or binary, or a column's name is empty or
  ///                    there twice.
  CsvReader(Source source, std::string path, Quotes quotes = Quotes::span_lines);

  /// A table without a header: each row is one of readings.
  /// @param source, path, quotes  as above.
  /// @param header                the columns' names.
  /// @throws DataError  if the file does not contain a row.
  CsvReader(Source source,
            std::string path,
            std::vector<std::string> header,
            Quotes quotes = Quotes::span_lines);

  /// Reads lines that another reader took, with the columns of that one.
  CsvReader(const CsvReader& of, Lines lines);

  /// Calls the columns otherwise than the file does.
  /// @throws DomainError  for another number of names than columns.
  void rename(std::vector<std::string> header);

  /// @return the columns' names.
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }

  /// @return the header as it stands in the file, without its line end.
  [[nodiscard]] const std::string& header_text() const { return header_text_; }

  /// @return the position of a column, or nullopt if no column has that name.
  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const;

  /// @return the position of a column.
  /// @throws DataError  if there is none of that name; the message lists those that there are.
  [[nodiscard]] std::size_t need(const std::string& name) const;

  /// Goes on to the next row.
  ///
  /// A row with the wrong number of cells, a quote that is not closed, text behind a closing quote
  /// or a NUL byte is `defective`: defect() says why, text() is the row (of an open quote its first
  /// line), and the next call goes on behind it.
  /// @throws DataError  if reading fails or a line is longer than longest_row.
  Row next();

  /// Takes the next lines, as many as fit into a buffer, so that another thread can parse them.
  /// They do not contain quotes: each line is one row.
  /// @return nullopt if one of the next lines contains a quote, or at the end.
  /// @throws DataError  as next().
  [[nodiscard]] std::optional<Lines> take_lines();

  /// @return the cells of a good row, unquoted; valid until next().
  [[nodiscard]] std::span<const std::string_view> cells() const { return cells_; }

  /// @return the row as it stands in the file, without its line end; valid until next(), of lines
  ///         that another reader took as long as this.
  [[nodiscard]] std::string_view text() const { return text_; }

  /// @return the number of cells of the row, even if the header has another number.
  [[nodiscard]] std::size_t cell_count() const { return cells_.size(); }

  /// @return the defect of a defective row, for a message.
  [[nodiscard]] const std::string& defect() const { return defect_; }

  /// @return the line on which the row starts, counted from 1.
  [[nodiscard]] std::size_t line() const { return line_; }

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  bool find_line_end(std::size_t from, std::size_t& end);
  void read_more();
  bool next_content_line();
  bool split_plain();
  bool split_quoted();
  bool unquote(std::size_t& i);
  void read_header();

  Source source_;
  std::string path_;
  Quotes quotes_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;     // where what is not yet consumed begins
  std::size_t filled_ = 0;    // end of the bytes in buffer_
  std::size_t row_end_ = 0;   // end of the row's text
  std::size_t consumed_ = 0;  // where the next row starts
  bool at_end_ = false;
  std::size_t line_ = 0;
  std::size_t next_line_ = 1;
  std::vector<std::string> header_;
  std::string header_text_;
  std::string_view text_;
  std::vector<std::string_view> cells_;
  std::string unquoted_;                                     // the cells of a row with quotes
  std::vector<std::pair<std::size_t, std::size_t>> pieces_;  // their places in unquoted_
  std::string defect_;
};

/// @return the text as a cell: in quotes where it holds a comma, a quote or a line end.
[[nodiscard]] AXISCAL_EXPORT std::string csv_cell(const std::string& text);

/// @return true if the text is valid UTF-8.
[[nodiscard]] AXISCAL_EXPORT bool is_utf8(std::string_view text) noexcept;

}  // namespace axiscal
