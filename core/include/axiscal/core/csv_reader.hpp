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

/// Reads comma-separated text row by row. The memory use does not depend on the length of the text.
/// The source may be a pipe, or a file that is larger than the memory.
///
/// The format is RFC 4180 with a header row, in UTF-8 with or without byte order mark, with LF or
/// CRLF. Empty lines and lines that start with `#` are skipped. Blanks around a cell are removed.
/// Reading a row allocates no memory once the buffers have the size of the longest row.
class AXISCAL_EXPORT CsvReader {
 public:
  /// Copies at most `size` of the next bytes to `buffer`. Returns their number; 0 at the end.
  using Source = std::function<std::size_t(char* buffer, std::size_t size)>;

  enum class Row { good, defective, end };

  /// Whether a quoted cell may continue on the next line. Use `end_with_line` for live data,
  /// because with `span_lines` a single unclosed quote delays all following rows.
  enum class Quotes { span_lines, end_with_line };

  /// Complete lines, unchanged from the file.
  struct Lines {
    std::vector<char> text;
    std::size_t first_line = 0;  ///< line number of the first line, counted from 1
  };

  /// The largest length of a row [bytes]. A longer row is an error, because the file is probably
  /// not a table of readings.
  static constexpr std::size_t longest_row = 1U << 20U;

  /// Reads the header.
  ///
  /// @param source  provides the bytes.
  /// @param path    the file's name for messages.
  /// @param quotes  whether a quoted cell may continue on the next line.
  /// @throws DataError  if the text is empty, is UTF-16 or binary, or a column's name is empty or
  ///                    repeated.
  CsvReader(Source source, std::string path, Quotes quotes = Quotes::span_lines);

  /// Makes a reader for a table without a header, whose first row already contains readings. The
  /// constructor does not read from `source`.
  /// @param source, path, quotes  as for the first constructor.
  /// @param header                the columns' names.
  CsvReader(Source source,
            std::string path,
            std::vector<std::string> header,
            Quotes quotes = Quotes::span_lines);

  /// Makes a reader for lines from `of.take_lines()`. The new reader has the same columns as `of`.
  CsvReader(const CsvReader& of, Lines lines);

  /// Replaces the names of the columns.
  /// @throws DomainError  if the number of names is not the number of columns.
  void rename(std::vector<std::string> header);

  /// @return the columns' names.
  [[nodiscard]] const std::vector<std::string>& header() const { return header_; }

  /// @return the text of the header row in the file, without its line end.
  [[nodiscard]] const std::string& header_text() const { return header_text_; }

  /// @return the index of a column; nullopt if no column has that name.
  [[nodiscard]] std::optional<std::size_t> column(std::string_view name) const;

  /// @return the index of a column.
  /// @throws DataError  if no column has that name; the message lists the existing columns.
  [[nodiscard]] std::size_t need(const std::string& name) const;

  /// Reads the next row.
  ///
  /// A row is `defective` if it has the wrong number of cells, an unclosed quote, text after a
  /// closing quote, or a NUL byte. Then defect() is the reason and text() is the row. If a quote is
  /// unclosed, text() is only the row's first line, and the following call of next() begins with
  /// the line after it.
  /// @throws DataError  if reading fails or a line is longer than longest_row.
  Row next();

  /// Takes the next lines, about 256 KiB, so that another thread can parse them. The lines contain
  /// no quotes, so each line is one row.
  /// @return nullopt at the end, or if a quote follows within the next 64 KiB.
  /// @throws DataError  for the same reasons as next().
  [[nodiscard]] std::optional<Lines> take_lines();

  /// @return the cells of a good row, unquoted; valid until next().
  [[nodiscard]] std::span<const std::string_view> cells() const { return cells_; }

  /// @return the row as in the file, without its line end. It is valid until next(); in a reader of
  ///         Lines it is valid as long as the reader exists.
  [[nodiscard]] std::string_view text() const { return text_; }

  /// @return the number of cells of the row. In a defective row it may differ from the number of
  ///         columns.
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
  std::size_t begin_ = 0;     // start of the bytes in buffer_ that are not consumed
  std::size_t filled_ = 0;    // end of the bytes in buffer_
  std::size_t row_end_ = 0;   // end of the row's text, relative to begin_
  std::size_t consumed_ = 0;  // start of the next row, relative to begin_
  bool at_end_ = false;
  std::size_t line_ = 0;
  std::size_t next_line_ = 1;
  std::vector<std::string> header_;
  std::string header_text_;
  std::string_view text_;
  std::vector<std::string_view> cells_;
  std::string unquoted_;                                     // cells of a quoted row, concatenated
  std::vector<std::pair<std::size_t, std::size_t>> pieces_;  // start and length of each cell
  std::string defect_;
};

/// @return the text as a CSV cell; quoted if it contains a comma, a quote or a line end.
[[nodiscard]] AXISCAL_EXPORT std::string csv_cell(const std::string& text);

/// @return true if the text is valid UTF-8.
[[nodiscard]] AXISCAL_EXPORT bool is_utf8(std::string_view text) noexcept;

}  // namespace axiscal
