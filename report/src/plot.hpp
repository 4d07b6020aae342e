// SPDX-License-Identifier: Apache-2.0
// Plots. Each plot is drawn as SVG and written as a table. The screen and the printer show the same
// drawing.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace axiscal {

struct PlotSeries {
  std::string name;
  bool line = false;                 ///< true: a line; false: points
  std::vector<double> x, y;          ///< points with y = NaN are left out
  std::vector<double> high;          ///< upper limits of a band from y to high; may be empty
  std::vector<int> runs;             ///< run of each point; empty if points are not readings
  std::optional<std::size_t> style;  ///< index of colour and marker; nullopt: index of the series
  bool in_legend = true;
};

/// A text at a point of a plot.
struct PlotLabel {
  double x = 0.0, y = 0.0;
  std::string text;
};

struct Plot {
  std::string id;
  std::string title;
  std::string alternative;  ///< description of the figure in words
  std::string x_label, y_label;
  std::vector<PlotSeries> series;
  std::vector<std::string> x_names;  ///< names of x = 0, 1, ..; empty: numbers
  bool equal_aspect = false;
  bool logarithmic = false;  ///< true: both axes are logarithmic
  bool narrow = false;       ///< true: narrow, for three plots side by side
  std::vector<PlotLabel> labels;
  std::string note;  ///< small text below the plot
};

/// Bars side by side: one group for each name, one bar in it for each series.
struct BarPlot {
  std::string id, title, alternative, value_label;
  std::vector<std::string> names;
  std::vector<std::string> series;
  std::vector<std::vector<double>> values;  ///< one list for each name, one number for each series
};

/// Values over two coordinates, as colours.
struct HeatMap {
  std::string id, title, alternative, x_label, y_label, value_label;
  std::vector<double> x, y;                 ///< evenly spaced
  std::vector<std::vector<double>> values;  ///< one list for each y, one number for each x
};

/// @return the plot with at most some hundred points. If it has more, up to four points of each
///         part along x are kept, including the lowest and the highest one. If equal_aspect is set,
///         each n-th point is kept. Plot::note states how many points are drawn.
[[nodiscard]] Plot thinned(Plot plot);

/// Writes the figures of a page. A figure has a title, a drawing and a data table. Each mark of the
/// drawing has a tooltip.
class Figures {
 public:
  /// @return the figure, thinned; empty for a plot without points.
  static std::string add(const Plot& plot);
  static std::string add(const BarPlot& plot);
  static std::string add(const HeatMap& map);

  /// @return several figures side by side.
  template <typename Plots>
  static std::string add_all(const Plots& plots, const char* style = "plots") {
    std::string html;
    for (const auto& plot : plots) {
      html += add(plot);
    }
    return side_by_side(html, style);
  }
  static std::string side_by_side(const std::string& figures, const char* style = "plots");
};

}  // namespace axiscal
