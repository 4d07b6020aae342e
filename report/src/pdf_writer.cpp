// SPDX-License-Identifier: Apache-2.0
#include "report/src/pdf_writer.hpp"

#ifdef AXISCAL_CAIRO
#include <algorithm>
#include <cairo/cairo-pdf.h>
#include <cmath>
#include <numeric>
#include <pango/pangocairo.h>
#include <utility>

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// All lengths are in points, 1/72 inch.
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

// Replaces control characters by blanks. Replaces invalid UTF-8 by `?`, because cairo accepts only
// valid UTF-8.
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
  Page(const PdfFrame& frame, int pages)
      : header_(printable(frame.header)), watermark_(printable(frame.watermark)), pages_(pages) {
    surface_ = cairo_pdf_surface_create_for_stream(append, &content_, page_width, page_height);
    cairo_pdf_surface_set_metadata(surface_, CAIRO_PDF_METADATA_TITLE,
                                   printable(frame.title).c_str());
    cairo_pdf_surface_set_metadata(surface_, CAIRO_PDF_METADATA_CREATOR, "axiscal");
    pen_ = cairo_create(surface_);
    layout_ = pango_cairo_create_layout(pen_);
    start_page();
  }
  ~Page() {
    g_object_unref(layout_);
    cairo_destroy(pen_);
    cairo_surface_destroy(surface_);
  }
  Page(const Page&) = delete;
  Page& operator=(const Page&) = delete;

  void font(double size, bool bold) {
    PangoFontDescription* const description = pango_font_description_new();
    pango_font_description_set_family(description, "sans-serif");
    pango_font_description_set_weight(description, bold ? PANGO_WEIGHT_BOLD : PANGO_WEIGHT_NORMAL);
    pango_font_description_set_absolute_size(description, size * PANGO_SCALE);
    pango_layout_set_font_description(layout_, description);
    pango_font_description_free(description);
    size_ = size;
    bold_ = bold;
  }

  [[nodiscard]] double width_of(const std::string& text) const {
    set_text(text, -1.0);
    PangoRectangle extents;
    pango_layout_get_extents(layout_, nullptr, &extents);
    return static_cast<double>(extents.width) / PANGO_SCALE;
  }

  // Starts a new page if a block of the given height does not fit on the current page. Then draws
  // the pending heading.
  void begin(double height) {
    constexpr double of_heading = 30.0;
    need(height + (heading_.empty() ? 0.0 : of_heading));
    if (!heading_.empty()) {
      font(11.5, true);
      y_ += 9.0;
      text_block(margin, text_width, std::exchange(heading_, ""));
      y_ += 3.0;
    }
  }

  // Draws one line of text with its baseline at y.
  void put(double x, double y, const std::string& text) {
    set_text(text, -1.0);
    cairo_move_to(pen_, x, y);
    pango_cairo_show_layout_line(pen_, pango_layout_get_line_readonly(layout_, 0));
  }

  // If `height` does not fit on this page, starts a new page and then calls `again`.
  void need(double height, const std::function<void()>& again = {}) {
    if (y_ + height > bottom) {
      const double size = size_;
      const bool bold = bold_;
      cairo_show_page(pen_);
      start_page();
      if (again) {
        again();
      }
      font(size, bold);
    }
  }

  // Draws a text in lines of the given width, broken at blanks if possible.
  void text_block(double x, double width, const std::string& text) {
    const std::string whole = printable(text);
    set_text(whole, width);
    // Copies all lines first, because the header of a new page uses the same layout.
    std::vector<std::string> lines;
    for (int i = 0; i < pango_layout_get_line_count(layout_); ++i) {
      const PangoLayoutLine* const line = pango_layout_get_line_readonly(layout_, i);
      lines.push_back(whole.substr(static_cast<std::size_t>(line->start_index),
                                   static_cast<std::size_t>(line->length)));
    }
    for (const std::string& line : lines) {
      need(size_ * line_height);
      y_ += size_ * line_height;
      put(x, y_, line);
    }
  }

  void rule(double width, double length = text_width) {
    cairo_set_line_width(pen_, width);
    cairo_move_to(pen_, margin, y_);
    cairo_line_to(pen_, margin + length, y_);
    cairo_stroke(pen_);
  }

  // Draws a picture of at most `wide` x `high`. If `to_the_right` is true, `x` is the coordinate of
  // the picture's right edge; otherwise `x` is the coordinate of its left edge.
  // @return the height of the picture.
  double picture(const std::string& path, double x, bool to_the_right, double wide, double high) {
    cairo_surface_t* const image = cairo_image_surface_create_from_png(path.c_str());
    if (cairo_surface_status(image) != CAIRO_STATUS_SUCCESS) {
      const std::string why = cairo_status_to_string(cairo_surface_status(image));
      cairo_surface_destroy(image);
      throw DataError(path, "is not a picture (PNG): " + why);
    }
    const double width = cairo_image_surface_get_width(image);
    const double height = cairo_image_surface_get_height(image);
    const double scale = std::min(wide / width, high / height);
    cairo_save(pen_);
    cairo_translate(pen_, to_the_right ? x - scale * width : x, y_);
    cairo_scale(pen_, scale, scale);
    cairo_set_source_surface(pen_, image, 0.0, 0.0);
    cairo_paint(pen_);
    cairo_restore(pen_);
    cairo_surface_destroy(image);
    return scale * height;
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
  std::string heading_;  // heading to be drawn above the next block
  std::string content_;

 private:
  void set_text(const std::string& text, double width) const {
    pango_layout_set_width(layout_,
                           width < 0.0 ? -1 : static_cast<int>(std::lround(width * PANGO_SCALE)));
    pango_layout_set_wrap(layout_, PANGO_WRAP_WORD_CHAR);
    pango_layout_set_text(layout_, text.c_str(), static_cast<int>(text.size()));
  }

  // Draws the watermark in light grey. It is drawn before the text, so that the text covers it.
  void put_watermark() {
    font(110.0, true);
    const double width = width_of(watermark_);
    cairo_save(pen_);
    cairo_translate(pen_, 0.5 * page_width, 0.5 * page_height);
    cairo_rotate(pen_, -0.9);
    cairo_set_source_rgb(pen_, 0.9, 0.9, 0.9);
    put(-0.5 * width, 36.0, watermark_);
    cairo_restore(pen_);
  }

  void start_page() {
    ++number_;
    if (!watermark_.empty()) {
      put_watermark();
    }
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
  std::string watermark_;
  int pages_;
  int number_ = 0;
  double size_ = body_size;
  bool bold_ = false;
  cairo_surface_t* surface_ = nullptr;
  cairo_t* pen_ = nullptr;
  PangoLayout* layout_ = nullptr;
};

PdfPages::PdfPages(const PdfFrame& frame, int pages)
    : page_(std::make_unique<Page>(frame, pages)) {}
PdfPages::~PdfPages() = default;

void PdfPages::pictures(const std::vector<std::string>& paths) {
  constexpr double high = 48.0;
  double tallest = 0.0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const bool is_last = i > 0 && i + 1 == paths.size();
    tallest = std::max(tallest, page_->picture(paths[i], is_last ? page_width - margin : margin,
                                               is_last, 0.4 * text_width, high));
  }
  page_->y_ += tallest + 6.0;
}

void PdfPages::title(const std::string& text) {
  page_->font(20.0, true);
  page_->y_ += 8.0;
  page_->text_block(margin, text_width, text);
  page_->y_ += 8.0;
}

// Stores the heading. It is drawn with the next block, so that both are on the same page.
void PdfPages::heading(const std::string& text) {
  page_->heading_ = text;
}

void PdfPages::paragraph(const std::string& text) {
  page_->begin(2.0 * body_size * line_height);
  page_->font(body_size, false);
  page_->text_block(margin, text_width, text);
  page_->y_ += 4.0;
}

void PdfPages::facts(const std::vector<std::pair<std::string, std::string>>& rows) {
  constexpr double at = 140.0;
  page_->begin(2.0 * body_size * line_height);
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

void PdfPages::table(const std::string& caption,
                     const std::vector<std::string>& head,
                     const std::vector<std::vector<std::string>>& rows) {
  constexpr double gap = 12.0;
  double size = 8.5;
  std::vector<double> widths;
  const auto measure = [&] {
    page_->font(size, true);
    widths.clear();
    for (std::size_t c = 0; c < head.size(); ++c) {
      double width = page_->width_of(printable(head[c]));
      for (const std::vector<std::string>& row : rows) {
        width = std::max(width, page_->width_of(printable(row[c])));
      }
      widths.push_back(width + gap);
    }
    return std::accumulate(widths.begin(), widths.end(), -gap);
  };
  double table_width = measure();
  if (table_width > text_width) {  // the font of a wide table is reduced
    size = std::max(5.0, size * (text_width / table_width));
    table_width = measure();
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
    page_->rule(0.6, std::min(table_width, text_width));
    page_->font(size, false);
  };
  constexpr double whole_page = bottom - margin;
  const double height =
      (static_cast<double>(rows.size()) + (caption.empty() ? 2.0 : 4.0)) * size * 1.5;
  page_->begin(height < 0.8 * whole_page ? height : 8.0 * size);
  if (!caption.empty()) {
    paragraph(caption);
  }
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
    page_->begin(60.0);
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

std::string pdf_of(const PdfFrame& frame, const std::function<void(PdfPages&)>& write) {
  PdfPages counted(frame, 0);
  write(counted);
  PdfPages pages(frame, counted.finish());
  write(pages);
  pages.finish();
  return pages.content();
}

}  // namespace axiscal
#endif
