// SPDX-License-Identifier: Apache-2.0
// Writes text, tables and pictures on A4 pages, by cairo and pango.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace axiscal {

/// The text that is on every page, and the title of the document.
struct PdfFrame {
  std::string title;
  std::string header;     ///< text at the top left; "page x of y" is at the top right
  std::string watermark;  ///< text across the page, such as "DRAFT"; may be empty
};

/// Writes a document from top to bottom, and starts a new page if a page is full.
class PdfPages {
 public:
  /// @param pages  the number of pages, known from a first pass; 0 in that pass.
  PdfPages(const PdfFrame& frame, int pages);
  ~PdfPages();
  PdfPages(const PdfPages&) = delete;
  PdfPages& operator=(const PdfPages&) = delete;

  /// Draws PNG files side by side, the first at the left margin and the last at the right margin.
  /// @throws DataError  if a file is not a picture.
  void pictures(const std::vector<std::string>& paths);
  void title(const std::string& text);
  /// Sets a heading, which will be on the same page as the next block.
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Writes a table of two columns: names at the left, texts at the right.
  void facts(const std::vector<std::pair<std::string, std::string>>& rows);
  /// Writes a table. The first column is aligned to the left, the others to the right. A table that
  /// fits on a page is not split. A longer table repeats its head on each page.
  /// @param caption  text above the table; may be empty.
  void table(const std::string& caption,
             const std::vector<std::string>& head,
             const std::vector<std::vector<std::string>>& rows);
  void signature_lines(const std::vector<std::pair<std::string, std::string>>& people);
  void centred(const std::string& text);

  /// Ends the last page. @return the number of pages.
  int finish();
  /// @return the document, after finish().
  [[nodiscard]] const std::string& content() const;

 private:
  class Page;
  std::unique_ptr<Page> page_;
};

/// @return the document that `write` writes. `write` is called twice: the first pass counts the
///         pages.
std::string pdf_of(const PdfFrame& frame, const std::function<void(PdfPages&)>& write);

}  // namespace axiscal
