// SPDX-License-Identifier: Apache-2.0
// Plots as SVG drawings with data tables. Screen and print show the same drawing.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace axiscal {

struct PlotSeries {
  std::string name;
  bool line = false;                 ///< true: a line; false: points
  std::vector<double> x, y;          ///< coordinates; a point with y = NaN is not drawn
  std::vector<double> high;          ///< upper edge of a band whose lower edge is y; empty: no band
  std::vector<int> runs;             ///< run number of each point; empty: points are not readings
  std::optional<std::size_t> style;  ///< index of colour and marker; nullopt: the series' own index
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
  std::string alternative;  ///< text alternative: a description of the figure in words
  std::string x_label, y_label;
  std::vector<PlotSeries> series;
  std::vector<std::string> x_names;  ///< labels for x = 0, 1, ..; empty: x is labelled by numbers
  bool equal_aspect = false;
  bool logarithmic = false;  ///< true: both axes are logarithmic
  bool narrow = false;       ///< true: narrow enough for three plots side by side
  std::vector<PlotLabel> labels;
  std::string note;  ///< small text below the plot
};

/// A bar chart. Each name has a group of bars; each series has one bar in the group.
struct BarPlot {
  std::string id, title, alternative, value_label;
  std::vector<std::string> names;
  std::vector<std::string> series;
  std::vector<std::vector<double>> values;  ///< one list per name, with one number per series
};

/// A map of a quantity over two coordinates. Colours show the values.
struct HeatMap {
  std::string id, title, alternative, x_label, y_label, value_label;
  std::vector<double> x, y;                 ///< evenly spaced
  std::vector<std::vector<double>> values;  ///< one list per y, with one number per x
};

/// @return the plot with at most some hundred points. A plot with more points is divided into parts
///         along x, and up to four points of each part are kept, including the lowest and the
///         highest. If equal_aspect is set, every n-th point is kept instead. Plot::note states how
///         many points are drawn.
[[nodiscard]] Plot thinned(Plot plot);

/// Writes the figures of a page. A figure has a title, a drawing and a data table. Each bar, cell
/// or point of the drawing has a tooltip.
class Figures {
 public:
  /// @return the figure of the plot, after thinned(); empty if the plot has no points.
  static std::string add(const Plot& plot);
  static std::string add(const BarPlot& plot);
  static std::string add(const HeatMap& map);

  /// @return the figures of several plots, side by side.
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
