// SPDX-License-Identifier: Apache-2.0
// Text, tables, pictures and rules down A4 pages, by cairo and pango.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace axiscal {

/// The head and foot of every page.
struct PdfFrame {
  std::string title;
  std::string header;     ///< at the left of the page's top; at its right stands "page x of y"
  std::string watermark;  ///< across the page, as "DRAFT"; empty: none
};

/// Writes down a page and starts the next where it is full.
class PdfPages {
 public:
  /// @param pages  how many there will be, as a first pass counted; 0: count them.
  PdfPages(const PdfFrame& frame, int pages);
  ~PdfPages();
  PdfPages(const PdfPages&) = delete;
  PdfPages& operator=(const PdfPages&) = delete;

  /// Pictures side by side, the first at the left, the last at the right; PNG files.
  /// @throws DataError  if a file is not a picture.
  void pictures(const std::vector<std::string>& paths);
  void title(const std::string& text);
  /// Stays on one page with the next block.
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Names at the left, with their texts at the right.
  void facts(const std::vector<std::pair<std::string, std::string>>& rows);
  /// The first column to the left, the others to the right. A table that a page can hold stands on
  /// one; of a longer one the head is repeated.
  /// @param caption  stands above it on the same page; may be empty.
  void table(const std::string& caption,
             const std::vector<std::string>& head,
             const std::vector<std::vector<std::string>>& rows);
  void signature_lines(const std::vector<std::pair<std::string, std::string>>& people);
  void centred(const std::string& text);

  /// Ends the last page. @return how many there are.
  int finish();
  /// @return the document, after finish().
  [[nodiscard]] const std::string& content() const;

 private:
  class Page;
  std::unique_ptr<Page> page_;
};

/// Lays a document out twice: the first pass counts its pages.
std::string pdf_of(const PdfFrame& frame, const std::function<void(PdfPages&)>& write);

}  // namespace axiscal
