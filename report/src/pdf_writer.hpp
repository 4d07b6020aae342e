// SPDX-License-Identifier: Apache-2.0
// Text, tables and rules down A4 pages, by cairo.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace axiscal {

/// Writes down a page and starts the next where it is full.
class PdfPages {
 public:
  /// @param header  at the left of every page's top; at its right stands "page x of y".
  /// @param pages   how many there will be, as a first pass counted; 0: count them.
  PdfPages(std::string title, std::string header, int pages);
  ~PdfPages();
  PdfPages(const PdfPages&) = delete;
  PdfPages& operator=(const PdfPages&) = delete;

  void title(const std::string& text);
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Names at the left, their texts beside them.
  void facts(const std::vector<std::pair<std::string, std::string>>& rows);
  /// The first column to the left, the others to the right; the head is repeated on a new page.
  void table(const std::vector<std::string>& head,
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
std::string pdf_of(const std::string& title,
                   const std::string& header,
                   const std::function<void(PdfPages&)>& write);

}  // namespace axiscal
