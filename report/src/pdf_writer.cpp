// SPDX-License-Identifier: Apache-2.0
#include "pdf_writer.hpp"

#ifdef AXISCAL_CAIRO
#include <algorithm>
#include <cairo/cairo-pdf.h>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

// Points of 1/72 inch.
constexpr double page_width = 595.28;
constexpr double page_height = 841.89;
constexpr double margin = 56.7;  // 20 mm
constexpr double bottom = page_height - margin;
constexpr double text_width = page_width - 2.0 * margin;
constexpr double body_size = 9.5;
constexpr double line_height = 1.35;

cairo_status_t append(void* to, const unsigned char* data, unsigned int size) {
  static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(data), size);
  return CAIRO_STATUS_SUCCESS;
}

// Cairo takes valid UTF-8 only, and control characters have no shape.
std::string printable(const std::string& text) {
  std::string safe;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0x80        ? 1
                               : lead >> 5U == 6  ? 2
                               : lead >> 4U == 14 ? 3
                               : lead >> 3U == 30 ? 4
                                                  : 0;
    const bool valid = length > 0 && is_utf8(std::string_view(text).substr(i, length));
    if (!valid) {
      safe += '?';
      ++i;
      continue;
    }
    safe += length == 1 && (lead < ' ' || lead == 0x7F) ? std::string(" ") : text.substr(i, length);
    i += length;
  }
  return safe;
}

}  // namespace

class PdfPages::Page {
 public:
  Page(const std::string& title, std::string header, int pages)
      : header_(printable(header)), pages_(pages) {
    surface_ = cairo_pdf_surface_create_for_stream(append, &content_, page_width, page_height);
    cairo_pdf_surface_set_metadata(surface_, CAIRO_PDF_METADATA_TITLE, printable(title).c_str());
    cairo_pdf_surface_set_metadata(surface_, CAIRO_PDF_METADATA_CREATOR, "axiscal");
    pen_ = cairo_create(surface_);
    start_page();
  }
  ~Page() {
    cairo_destroy(pen_);
    cairo_surface_destroy(surface_);
  }
  Page(const Page&) = delete;
  Page& operator=(const Page&) = delete;

  void font(double size, bool bold) {
    cairo_select_font_face(pen_, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(pen_, size);
    size_ = size;
  }

  [[nodiscard]] double width_of(const std::string& text) const {
    cairo_text_extents_t extents;
    cairo_text_extents(pen_, text.c_str(), &extents);
    return extents.x_advance;
  }

  void put(double x, double y, const std::string& text) {
    cairo_move_to(pen_, x, y);
    cairo_show_text(pen_, text.c_str());
  }

  // Starts the next page unless so much room is left; `again` is drawn at its top.
  void need(double height, const std::function<void()>& again = {}) {
    if (y_ + height > bottom) {
      const double size = size_;
      cairo_show_page(pen_);
      start_page();
      if (again) {
        again();
      }
      font(size, false);
    }
  }

  // Broken at blanks into the width; a word that is wider is cut.
  [[nodiscard]] std::vector<std::string> lines_of(const std::string& text, double width) const {
    std::vector<std::string> lines;
    std::string line;
    for (std::string_view part : split(text, ' ')) {
      std::string word(part);
      const std::string longer = line.empty() ? word : line + " " + word;
      if (width_of(longer) <= width) {
        line = longer;
        continue;
      }
      if (!line.empty()) {
        lines.push_back(line);
      }
      while (width_of(word) > width && word.size() > 4) {
        std::size_t fits = 1;
        for (std::size_t too_many = word.size(); too_many - fits > 1;) {
          const std::size_t middle = (fits + too_many) / 2;
          (width_of(word.substr(0, middle)) > width ? too_many : fits) = middle;
        }
        while (fits > 1 && (static_cast<unsigned char>(word[fits]) & 0xC0U) == 0x80U) {
          --fits;  // not within a character
        }
        lines.push_back(word.substr(0, fits));
        word.erase(0, fits);
      }
      line = word;
    }
    if (!line.empty() || lines.empty()) {
      lines.push_back(line);
    }
    return lines;
  }

  void text_block(double x, double width, const std::string& text) {
    for (const std::string& line : lines_of(printable(text), width)) {
      need(size_ * line_height);
      y_ += size_ * line_height;
      put(x, y_, line);
    }
  }

  void rule(double width) {
    cairo_set_line_width(pen_, width);
    cairo_move_to(pen_, margin, y_);
    cairo_line_to(pen_, page_width - margin, y_);
    cairo_stroke(pen_);
  }

  int finish() {
    cairo_show_page(pen_);
    cairo_surface_finish(surface_);
    if (cairo_surface_status(surface_) != CAIRO_STATUS_SUCCESS) {
      throw OutputError(std::string("PDF: ") +
                        cairo_status_to_string(cairo_surface_status(surface_)));
    }
    return number_;
  }

  double y_ = 0.0;
  std::string content_;

 private:
  void start_page() {
    ++number_;
    font(8.0, false);
    put(margin, margin - 14.0, header_);
    const std::string place =
        formatted("page {}{}", number_, pages_ > 0 ? formatted(" of {}", pages_) : "");
    put(page_width - margin - width_of(place), margin - 14.0, place);
    y_ = margin - 8.0;
    rule(0.5);
    y_ = margin;
  }

  std::string header_;
  int pages_;
  int number_ = 0;
  double size_ = body_size;
  cairo_surface_t* surface_ = nullptr;
  cairo_t* pen_ = nullptr;
};

PdfPages::PdfPages(std::string title, std::string header, int pages)
    : page_(std::make_unique<Page>(title, std::move(header), pages)) {}
PdfPages::~PdfPages() = default;

void PdfPages::title(const std::string& text) {
  page_->font(20.0, true);
  page_->y_ += 8.0;
  page_->text_block(margin, text_width, text);
  page_->y_ += 8.0;
}

void PdfPages::heading(const std::string& text) {
  page_->need(50.0);
  page_->font(11.5, true);
  page_->y_ += 9.0;
  page_->text_block(margin, text_width, text);
  page_->y_ += 3.0;
}

void PdfPages::paragraph(const std::string& text) {
  page_->font(body_size, false);
  page_->text_block(margin, text_width, text);
  page_->y_ += 4.0;
}

void PdfPages::facts(const std::vector<std::pair<std::string, std::string>>& rows) {
  constexpr double at = 140.0;
  page_->font(body_size, false);
  for (const auto& [name, text] : rows) {
    if (text.empty()) {
      continue;
    }
    page_->need(body_size * line_height);
    const double top = page_->y_;
    page_->put(margin, top + body_size * line_height, printable(name));
    page_->text_block(margin + at, text_width - at, text);
    page_->y_ += 1.5;
  }
}

void PdfPages::table(const std::vector<std::string>& head,
                     const std::vector<std::vector<std::string>>& rows) {
  constexpr double size = 8.5;
  constexpr double gap = 12.0;
  page_->font(size, true);
  std::vector<double> widths;
  for (std::size_t c = 0; c < head.size(); ++c) {
    double width = page_->width_of(printable(head[c]));
    for (const std::vector<std::string>& row : rows) {
      width = std::max(width, page_->width_of(printable(row[c])));
    }
    widths.push_back(width + gap);
  }
  const auto put_row = [&](const std::vector<std::string>& row) {
    page_->y_ += size * 1.5;
    double right = margin;
    for (std::size_t c = 0; c < row.size(); ++c) {
      right += widths[c];
      const std::string text = printable(row[c]);
      page_->put(c == 0 ? margin : right - gap - page_->width_of(text), page_->y_, text);
    }
  };
  const auto put_head = [&] {
    page_->font(size, true);
    put_row(head);
    page_->y_ += 3.0;
    page_->rule(0.6);
    page_->font(size, false);
  };
  page_->need(4.0 * size);
  put_head();
  for (const std::vector<std::string>& row : rows) {
    page_->need(size * 1.5, put_head);
    page_->font(size, false);
    put_row(row);
  }
  page_->y_ += 8.0;
}

void PdfPages::signature_lines(const std::vector<std::pair<std::string, std::string>>& people) {
  for (const auto& [name, function] : people) {
    page_->need(60.0);
    page_->y_ += 38.0;
    page_->rule(0.4);
    page_->font(body_size, false);
    page_->text_block(margin, text_width, name + (function.empty() ? "" : ", " + function));
  }
}

void PdfPages::centred(const std::string& text) {
  page_->font(body_size, false);
  page_->need(30.0);
  page_->y_ += 24.0;
  page_->put(0.5 * (page_width - page_->width_of(text)), page_->y_, text);
}

int PdfPages::finish() {
  return page_->finish();
}

const std::string& PdfPages::content() const {
  return page_->content_;
}

std::string pdf_of(const std::string& title,
                   const std::string& header,
                   const std::function<void(PdfPages&)>& write) {
  PdfPages counted(title, header, 0);
  write(counted);
  PdfPages pages(title, header, counted.finish());
  write(pages);
  pages.finish();
  return pages.content();
}

}  // namespace axiscal
#endif
