// SPDX-License-Identifier: Apache-2.0
#include "report/src/plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"

namespace axiscal {
namespace {

constexpr double height = 300.0;

// The edges of the plot area within the drawing, in units of the drawing.
struct Frame {
  explicit Frame(bool narrow = false) : width(narrow ? 360.0 : 540.0), right(width - 12.0) {}

  double width;
  double left = 74.0;
  double right;
  double top = 14.0;
  double bottom = height - 48.0;
};

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double value) {
    if (std::isfinite(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  void pad(double share) {
    if (!(low <= high)) {
      low = 0.0;
      high = 1.0;
    }
    // A range of values that differ only by rounding is too small for ticks, so it is widened as
    // for equal values.
    const double size = std::max(std::abs(low), std::abs(high));
    const bool is_constant = high - low <= 1e-12 * size;
    const double room = is_constant ? std::max(1e-12, 0.1 * size) : share * (high - low);
    low -= room;
    high += room;
  }
};

// Returns the positions of ticks. Their distance is 1, 2 or 5 times a power of ten.
std::vector<double> ticks_of(const Range& range, int about) {
  const double raw = (range.high - range.low) / about;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / power;
  const double step = power * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
  std::vector<double> ticks;
  for (double at = std::ceil(range.low / step); at * step <= range.high; at += 1.0) {
    ticks.push_back(at * step);
  }
  return ticks;
}

std::string tick_text(double value) {
  std::string text = number_text(std::abs(value) < 1e-15 ? 0.0 : value, 4);
  return text.front() == '-' ? "\u2212" + text.substr(1) : text;
}

std::string svg_line(const char* style, double x1, double y1, double x2, double y2) {
  return formatted("<line class=\"{}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>", style,
                   svg_number(x1), svg_number(y1), svg_number(x2), svg_number(y2));
}

std::string svg_text(const char* style, double x, double y, const std::string& text) {
  return formatted("<text class=\"{}\" x=\"{}\" y=\"{}\">{}</text>", style, svg_number(x),
                   svg_number(y), escaped(text));
}

std::string svg_open(const Frame& frame, const std::string& alternative) {
  return formatted("<svg class=\"drawn\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
                   svg_number(frame.width), svg_number(height), escaped(alternative));
}

std::string upright(double x, double y, const std::string& text) {
  return formatted("<text class=\"label\" transform=\"translate({} {}) rotate(-90)\">{}</text>",
                   svg_number(x), svg_number(y), escaped(text));
}

// The attributes and the tooltip of a marker.
struct MarkContent {
  std::string attributes, title;
};
// Draws a circle, square, triangle or diamond, so that series differ by more than their colours.
// @param size  scale of the marker; 1 is a radius of 4 units of the drawing.
std::string marker(
    std::size_t series, double x, double y, double size, const MarkContent& content) {
  const std::string start = formatted("class=\"mark s{}\"{}", series % 6, content.attributes);
  switch (series % 4) {
    case 0:
      return formatted("<circle {} cx=\"{}\" cy=\"{}\" r=\"{}\">{}</circle>", start, svg_number(x),
                       svg_number(y), svg_number(4.0 * size), content.title);
    case 1:
      return formatted("<rect {} x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">{}</rect>", start,
                       svg_number(x - 3.6 * size), svg_number(y - 3.6 * size),
                       svg_number(7.2 * size), svg_number(7.2 * size), content.title);
    case 2:
      return formatted("<polygon {} points=\"{},{} {},{} {},{}\">{}</polygon>", start,
                       svg_number(x), svg_number(y - 4.8 * size), svg_number(x + 4.6 * size),
                       svg_number(y + 3.6 * size), svg_number(x - 4.6 * size),
                       svg_number(y + 3.6 * size), content.title);
    default:
      return formatted("<polygon {} points=\"{},{} {},{} {},{} {},{}\">{}</polygon>", start,
                       svg_number(x), svg_number(y - 5.0 * size), svg_number(x + 5.0 * size),
                       svg_number(y), svg_number(x), svg_number(y + 5.0 * size),
                       svg_number(x - 5.0 * size), svg_number(y), content.title);
  }
}

std::string title_of(const std::string& words) {
  return formatted("<title>{}</title>", escaped(words));
}

// Returns the attribute with the run number of a point, and the point's tooltip.
MarkContent content_of(const Plot& plot, const PlotSeries& series, std::size_t i) {
  MarkContent content;
  std::string words = series.name + ": ";
  if (!series.runs.empty()) {
    content.attributes = formatted(" data-run=\"{}\"", series.runs[i]);
    words += plot.x_label == "run" ? "" : formatted("run {}, ", series.runs[i]);
  }
  const bool is_named = !plot.x_names.empty();
  content.title = title_of(formatted(
      "{}{} {}, {} {}", words, plot.x_label,
      is_named ? plot.x_names[static_cast<std::size_t>(series.x[i])] : tick_text(series.x[i]),
      plot.y_label, tick_text(series.y[i])));
  return content;
}

// Maps the values of a plot to coordinates of the drawing.
class Scales {
 public:
  explicit Scales(const Plot& plot) : frame_(plot.narrow), logarithmic_(plot.logarithmic) {
    for (const PlotSeries& series : plot.series) {
      for (std::size_t i = 0; i < series.x.size(); ++i) {
        x_.take(scaled(series.x[i]));
        y_.take(scaled(series.y[i]));
        if (!series.high.empty()) {
          y_.take(scaled(series.high[i]));
        }
      }
    }
    x_.pad(0.05);
    y_.pad(0.07);
    if (plot.equal_aspect) {
      const double per_x = (x_.high - x_.low) / (frame_.right - frame_.left);
      const double per_y = (y_.high - y_.low) / (frame_.bottom - frame_.top);
      widen(x_, per_x, std::max(per_x, per_y));
      widen(y_, per_y, std::max(per_x, per_y));
    }
  }

  [[nodiscard]] double x(double value) const {
    return frame_.left +
           (scaled(value) - x_.low) / (x_.high - x_.low) * (frame_.right - frame_.left);
  }
  [[nodiscard]] double y(double value) const {
    return frame_.bottom -
           (scaled(value) - y_.low) / (y_.high - y_.low) * (frame_.bottom - frame_.top);
  }

  [[nodiscard]] const Frame& frame() const { return frame_; }

  [[nodiscard]] std::string axes(const Plot& plot) const {
    std::string svg;
    std::vector<double> marks = marks_of(x_, plot.narrow ? 5 : 7);
    if (!plot.x_names.empty()) {
      marks.clear();
      for (std::size_t i = 0; i < plot.x_names.size(); ++i) {
        marks.push_back(static_cast<double>(i));
      }
    }
    for (const double mark : marks) {
      svg += svg_line("grid", x(mark), frame_.top, x(mark), frame_.bottom);
      const std::string text =
          plot.x_names.empty() ? tick_text(mark) : plot.x_names[static_cast<std::size_t>(mark)];
      // A letter at font size 12 is about 6.4 units wide. A long text near the right edge is moved
      // to the left, so that it is not cut off.
      const double half = 3.2 * static_cast<double>(text.size());
      svg += svg_text("tick middle", std::min(x(mark), frame_.width - half), frame_.bottom + 17.0,
                      text);
    }
    for (const double mark : marks_of(y_, 6)) {
      svg += svg_line("grid", frame_.left, y(mark), frame_.right, y(mark));
      svg += svg_text("tick end", frame_.left - 6.0, y(mark) + 4.0, tick_text(mark));
    }
    svg += svg_text("label middle", 0.5 * (frame_.left + frame_.right), height - 8.0, plot.x_label);
    return svg + upright(16.0, 0.5 * (frame_.top + frame_.bottom), plot.y_label);
  }

 private:
  [[nodiscard]] double scaled(double value) const {
    return logarithmic_ ? std::log10(value) : value;
  }

  // Returns the positions of ticks. On a logarithmic axis they are powers of ten. If the axis
  // covers less than two decades, 2 and 5 times a power of ten are added.
  [[nodiscard]] std::vector<double> marks_of(const Range& range, int about) const {
    if (!logarithmic_) {
      return ticks_of(range, about);
    }
    std::vector<double> marks;
    for (double power = std::floor(range.low); power <= range.high; power += 1.0) {
      for (const double lead : {1.0, 2.0, 5.0}) {
        const double mark = lead * std::pow(10.0, power);
        const double at = std::log10(mark);
        if (at >= range.low && at <= range.high && (lead == 1.0 || range.high - range.low < 2.0)) {
          marks.push_back(mark);
        }
      }
    }
    return marks;
  }

  static void widen(Range& range, double per_unit, double wanted) {
    const double more = 0.5 * (wanted / per_unit - 1.0) * (range.high - range.low);
    range.low -= more;
    range.high += more;
  }

  Frame frame_;
  bool logarithmic_;
  Range x_, y_;
};

std::string drawn(const Plot& plot, const PlotSeries& series, std::size_t k, const Scales& at) {
  std::string svg;
  if (!series.high.empty()) {
    std::string points;
    const auto add = [&](std::size_t i, double y) {
      if (std::isfinite(y)) {
        points += formatted("{},{} ", svg_number(at.x(series.x[i])), svg_number(at.y(y)));
      }
    };
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      add(i, series.y[i]);
    }
    for (std::size_t i = series.x.size(); i-- > 0;) {
      add(i, series.high[i]);
    }
    return formatted("<polygon class=\"area\" points=\"{}\"/>", points);
  }
  if (series.line) {
    const std::string open = formatted("<polyline class=\"curve s{}\" points=\"", k % 6);
    std::string points;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (std::isfinite(series.y[i])) {
        points += formatted("{},{} ", svg_number(at.x(series.x[i])), svg_number(at.y(series.y[i])));
      } else {  // NaN ends the line; a new line begins after it
        points += "\"/>" + open;
      }
    }
    return open + points + "\"/>";
  }
  constexpr std::size_t many = 150;
  const double size = series.x.size() > many ? 0.6 : 1.0;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (std::isfinite(series.y[i])) {
      svg += marker(k, at.x(series.x[i]), at.y(series.y[i]), size, content_of(plot, series, i));
    }
  }
  return svg;
}

struct LegendEntry {
  std::string name;
  std::string sign;  // SVG of the marker, in a box of 12 x 12
};

std::string legend(const std::vector<LegendEntry>& entries) {
  if (entries.size() < 2) {
    return "";
  }
  std::string html = "<p class=\"legend\">";
  for (const LegendEntry& entry : entries) {
    html += formatted("<span><svg viewBox=\"0 0 12 12\" aria-hidden=\"true\">{}</svg>{}</span> ",
                      entry.sign, escaped(entry.name));
  }
  return html + "</p>";
}

std::string sign_of(const PlotSeries& series, std::size_t k) {
  if (!series.high.empty()) {
    return "<rect class=\"area\" width=\"12\" height=\"12\"/>";
  }
  return series.line ? formatted("<polyline class=\"curve s{}\" points=\"0,6 12,6\"/>", k % 6)
                     : marker(k, 6.0, 6.0, 1.0, {});
}

std::string figure(const std::string& id,
                   const std::string& title,
                   const std::string& svg,
                   const std::string& below,
                   const std::string& table) {
  return formatted(
      "<figure id=\"{}\"><figcaption>{}</figcaption><div "
      "class=\"plot\">{}</div>{}<details><summary>Data</summary>{}</details></figure>\n",
      escaped(id), escaped(title), svg, below, table);
}

void keep(const PlotSeries& series, std::size_t i, PlotSeries& kept) {
  kept.x.push_back(series.x[i]);
  kept.y.push_back(series.y[i]);
  if (!series.runs.empty()) {
    kept.runs.push_back(series.runs[i]);
  }
}

// Keeps every `step`-th point of each series of points. The cloud of points keeps its shape.
Plot thinned_cloud(Plot plot, std::size_t step) {
  for (PlotSeries& series : plot.series) {
    if (series.line || series.x.size() <= step) {
      continue;
    }
    PlotSeries kept{.name = series.name};
    for (std::size_t i = 0; i < series.x.size(); i += step) {
      keep(series, i, kept);
    }
    series = std::move(kept);
  }
  plot.note = formatted("one of every {} points is drawn", step);
  return plot;
}

std::string table_of(const Plot& plot) {
  std::vector<std::vector<Cell>> rows;
  for (const PlotSeries& series : plot.series) {
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      const bool named = !plot.x_names.empty();
      rows.push_back({{series.name, ""},
                      named ? Cell{plot.x_names[static_cast<std::size_t>(series.x[i])], ""}
                            : number_cell(series.x[i]),
                      number_cell(series.y[i])});
      if (!series.high.empty()) {
        rows.back().push_back(number_cell(series.high[i]));
      }
    }
  }
  return html_table("", {"series", plot.x_label, plot.y_label}, rows);
}

}  // namespace

Plot thinned(Plot plot) {
  constexpr std::size_t most = 600;
  constexpr std::size_t kept_of_stretch = 4;
  std::size_t points = 0;
  std::size_t groups = 0;
  const auto is_thinned = [](const PlotSeries& series) {
    return !series.line && series.high.empty();
  };
  for (const PlotSeries& series : plot.series) {
    points += is_thinned(series) ? series.x.size() : 0;
    groups += is_thinned(series) ? 1U : 0U;
  }
  if (points <= most) {
    return plot;
  }
  plot.labels.clear();  // thousands of labels would cover each other
  if (plot.equal_aspect) {
    return thinned_cloud(std::move(plot), (points + most - 1) / most);
  }
  const std::size_t stretches = std::max<std::size_t>(most / (kept_of_stretch * groups), 1);
  std::size_t drawn_points = 0;
  for (PlotSeries& series : plot.series) {
    const std::size_t n = series.x.size();
    if (!is_thinned(series) || n <= kept_of_stretch * stretches) {
      drawn_points += is_thinned(series) ? n : 0;
      continue;
    }
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return series.x[a] < series.x[b]; });
    PlotSeries kept{.name = series.name};
    for (std::size_t s = 0; s < stretches; ++s) {
      const std::size_t first = s * n / stretches;
      const std::size_t end = (s + 1) * n / stretches;
      std::set<std::size_t> chosen = {first, first + (end - first) / 2};
      const auto by_y = [&](std::size_t a, std::size_t b) { return series.y[a] < series.y[b]; };
      const auto [low, high] =
          std::minmax_element(order.begin() + static_cast<std::ptrdiff_t>(first),
                              order.begin() + static_cast<std::ptrdiff_t>(end), by_y);
      chosen.insert(static_cast<std::size_t>(low - order.begin()));
      chosen.insert(static_cast<std::size_t>(high - order.begin()));
      for (const std::size_t at : chosen) {
        keep(series, order[at], kept);
      }
    }
    drawn_points += kept.x.size();
    series = std::move(kept);
  }
  plot.note = formatted(
      "{} of {} points are drawn, including the lowest and the highest point of each "
      "interval of x",
      drawn_points, points);
  return plot;
}

namespace {

bool has_points(const Plot& plot) {
  return std::any_of(plot.series.begin(), plot.series.end(), [](const PlotSeries& one) {
    return std::any_of(one.y.begin(), one.y.end(), [](double y) { return std::isfinite(y); });
  });
}

}  // namespace

std::string Figures::side_by_side(const std::string& figures, const char* style) {
  return figures.empty() ? "" : formatted("<div class=\"{}\">{}</div>\n", style, figures);
}

std::string Figures::add(const Plot& whole) {
  if (!has_points(whole)) {
    return "";
  }
  const Plot plot = thinned(whole);
  const Scales at(plot);
  std::string svg = svg_open(at.frame(), plot.alternative) + at.axes(plot);
  std::vector<LegendEntry> entries;
  for (std::size_t k = 0; k < plot.series.size(); ++k) {
    const std::size_t style = plot.series[k].style.value_or(k);
    svg += drawn(plot, plot.series[k], style, at);
    if (plot.series[k].in_legend) {
      entries.push_back({plot.series[k].name, sign_of(plot.series[k], style)});
    }
  }
  for (const PlotLabel& label : plot.labels) {
    svg += svg_text("tick", at.x(label.x) + 7.0, at.y(label.y) - 6.0, label.text);
  }
  const std::string note =
      plot.note.empty() ? "" : formatted("<p class=\"note\">{}</p>", escaped(plot.note));
  return figure(plot.id, plot.title, svg + "</svg>", legend(entries) + note, table_of(plot));
}

std::string Figures::add(const BarPlot& plot) {
  const Frame frame;
  Range range;
  range.take(0.0);
  for (const std::vector<double>& row : plot.values) {
    for (const double value : row) {
      range.take(value);
    }
  }
  range.pad(0.05);
  range.low = 0.0;
  const auto y = [&](double value) {
    return frame.bottom - value / range.high * (frame.bottom - frame.top);
  };
  std::string svg = svg_open(frame, plot.alternative);
  for (const double mark : ticks_of(range, 6)) {
    svg += svg_line("grid", frame.left, y(mark), frame.right, y(mark));
    svg += svg_text("tick end", frame.left - 6.0, y(mark) + 4.0, tick_text(mark));
  }
  const double group = (frame.right - frame.left) / static_cast<double>(plot.names.size());
  const double bar = 0.8 * group / static_cast<double>(plot.series.size());
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < plot.names.size(); ++i) {
    const double left = frame.left + (static_cast<double>(i) + 0.1) * group;
    rows.push_back({{plot.names[i], ""}});
    for (std::size_t s = 0; s < plot.series.size(); ++s) {
      const double value = plot.values[i][s];
      rows.back().push_back(number_cell(value, 3));
      if (std::isfinite(value)) {
        svg += formatted(
            "<rect class=\"bar s{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">{}</rect>", s % 6,
            svg_number(left + static_cast<double>(s) * bar), svg_number(y(value)),
            svg_number(0.92 * bar), svg_number(frame.bottom - y(value)),
            title_of(formatted("{}, {}: {} {}", plot.names[i], plot.series[s], plot.value_label,
                               tick_text(value))));
      }
    }
    svg += svg_text("tick middle", left + 0.4 * group, frame.bottom + 17.0, plot.names[i]);
  }
  svg += upright(16.0, 0.5 * (frame.top + frame.bottom), plot.value_label);
  std::vector<std::string> head = {"quantity"};
  head.insert(head.end(), plot.series.begin(), plot.series.end());
  std::vector<LegendEntry> entries;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    entries.push_back(
        {plot.series[s], formatted("<rect class=\"bar s{}\" width=\"12\" height=\"12\"/>", s % 6)});
  }
  return figure(plot.id, plot.title, svg + "</svg>", legend(entries),
                html_table(plot.value_label, head, rows));
}

std::string Figures::add(const HeatMap& map) {
  const Frame frame;
  Range range;
  for (const std::vector<double>& row : map.values) {
    for (const double value : row) {
      range.take(value);
    }
  }
  const double low = range.low;
  const double high = range.high;
  // Returns the opacity of a cell (6 % to 100 %). It makes the map readable without colours.
  const auto shade = [&](double value) {
    const double share = high > low ? (value - low) / (high - low) : 0.0;
    return number_text(std::round(100.0 * (0.06 + 0.94 * share)) / 100.0);
  };
  const auto columns = static_cast<double>(map.x.size());
  const auto lines = static_cast<double>(map.y.size());
  const double cell_width = (frame.right - frame.left) / columns;
  const double cell_height = (frame.bottom - frame.top) / lines;
  std::string svg = svg_open(frame, map.alternative) + "<g class=\"heat\">";
  std::vector<std::vector<Cell>> rows;
  for (std::size_t j = 0; j < map.y.size(); ++j) {
    const double top = frame.bottom - (static_cast<double>(j) + 1.0) * cell_height;
    rows.push_back({number_cell(map.y[j])});
    for (std::size_t i = 0; i < map.x.size(); ++i) {
      const double value = map.values[j][i];
      rows.back().push_back(number_cell(value, 3));
      if (std::isfinite(value)) {
        svg += formatted(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill-opacity=\"{}\">{}</rect>",
            svg_number(frame.left + static_cast<double>(i) * cell_width), svg_number(top),
            svg_number(cell_width), svg_number(cell_height), shade(value),
            title_of(formatted("{} {}, {} {}: {}", map.x_label, tick_text(map.x[i]), map.y_label,
                               tick_text(map.y[j]), number_text(value, 3))));
      }
    }
  }
  svg += "</g>";
  const auto every = [](std::size_t count) { return std::max<std::size_t>(1, (count - 1) / 6); };
  for (std::size_t i = 0; i < map.x.size(); i += every(map.x.size())) {
    svg += svg_text("tick middle", frame.left + (static_cast<double>(i) + 0.5) * cell_width,
                    frame.bottom + 17.0, tick_text(map.x[i]));
  }
  for (std::size_t j = 0; j < map.y.size(); j += every(map.y.size())) {
    svg += svg_text("tick end", frame.left - 6.0,
                    frame.bottom - (static_cast<double>(j) + 0.5) * cell_height + 4.0,
                    tick_text(map.y[j]));
  }
  svg += svg_text("label middle", 0.5 * (frame.left + frame.right), height - 8.0, map.x_label);
  svg += upright(16.0, 0.5 * (frame.top + frame.bottom), map.y_label);
  std::vector<std::string> head = {formatted("{} \\ {}", map.y_label, map.x_label)};
  for (const double x : map.x) {
    head.push_back(number_text(x, 5));
  }
  const std::string key = formatted(
      "<p class=\"legend\"><span>{} from {}</span><span class=\"key\"></span><span>to "
      "{}</span></p>",
      escaped(map.value_label), rounded(low), rounded(high));
  return figure(map.id, map.title, svg + "</svg>", key, html_table(map.value_label, head, rows));
}

}  // namespace axiscal
