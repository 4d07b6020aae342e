// SPDX-License-Identifier: Apache-2.0
// A plot is described once: drawn as SVG, handed to the page's script, and told as a table.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace axiscal {

struct PlotSeries {
  std::string name;
  bool line = false;         ///< else points
  std::vector<double> x, y;  ///< y of NaN is left out
  std::vector<double> high;  ///< where there are such: a band from y to high
};

struct Plot {
  std::string id;
  std::string title;
  std::string alternative;  ///< what it shows, in words
  std::string x_label, y_label;
  std::vector<PlotSeries> series;
  std::vector<std::string> x_names;  ///< what x = 0, 1, .. are called; else numbers
  bool equal_aspect = false;
  bool logarithmic = false;  ///< both axes
  /// x in degrees from -180 to 180 and y from -1 to 1 map a sphere so that equal areas are equal.
  bool is_sphere = false;
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

/// @return a plot with at most some hundred points in all. Of more, those of each stretch along x
///         that are lowest and highest and two others, so that no extreme is lost; of a sphere one
///         of each series in each of equal areas, so that no gap opens. The title says how many.
[[nodiscard]] Plot thinned(Plot plot);

/// @return a figure: title, drawing, room for the script's plot, data table.
std::string figure_of(const Plot& plot);
std::string figure_of(const BarPlot& plot);
std::string figure_of(const HeatMap& map);

/// @return a plot for the script.
nlohmann::ordered_json plot_json(const Plot& plot);

}  // namespace axiscal
