// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "report/src/report_plots.hpp"

namespace axiscal {
namespace {

// Returns one series of points for each axis.
// @param x_of  function that returns the abscissa of a reading; the reading is left out if it
//              returns nullopt.
template <typename XOf>
std::vector<PlotSeries> series_by_axis(const Calibration& calibration, const XOf& x_of) {
  std::vector<PlotSeries> all;
  for (Eigen::Index k = 0; k < calibration.sensor.instrument.axis_count(); ++k) {
    PlotSeries series{.name = axis_name(calibration, k)};
    for (const ReadingResidual& residual : calibration.fit.residuals) {
      const std::optional<double> x = x_of(residual);
      if (residual.used && x && k < residual.response.size()) {
        series.x.push_back(*x);
        series.y.push_back(residual.response(k));
        series.runs.push_back(residual.run);
      }
    }
    all.push_back(std::move(series));
  }
  return all;
}

// Returns true if the points differ in x. Otherwise the plot is left out.
bool differ_along_x(const std::vector<PlotSeries>& series) {
  return std::any_of(series.begin(), series.end(), [](const PlotSeries& one) {
    const auto [low, high] = std::minmax_element(one.x.begin(), one.x.end());
    constexpr double rounding = 1e-6;
    return low != one.x.end() &&
           *high - *low > rounding * std::max(std::abs(*low), std::abs(*high));
  });
}

// Returns true if there are breaks between the readings. Without breaks, a plot against time shows
// the same as the plot against the run number.
bool have_breaks(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    steps.push_back(times[i] - times[i - 1]);
  }
  if (steps.size() < 3) {
    return false;
  }
  std::sort(steps.begin(), steps.end());
  return steps.back() > 3.0 * steps[steps.size() / 2];
}

Plot by_face(const Calibration& calibration, const std::string& label) {
  Plot plot{.id = "residuals-by-face",
            .title = "Residuals by the face on the table",
            .alternative =
                "Residuals of each axis for each of the six faces; if a face deviates in all "
                "axes, its feet may be the cause",
            .x_label = "face on the table",
            .y_label = label};
  std::vector<std::string> names;
  for (const Face face : all_faces) {
    names.emplace_back(face_name(face));
  }
  plot.x_names = names;
  plot.series = series_by_axis(calibration, [](const ReadingResidual& r) -> std::optional<double> {
    if (!r.point) {
      return std::nullopt;
    }
    const auto at = std::find(all_faces.begin(), all_faces.end(), r.point->rest());
    return static_cast<double>(at - all_faces.begin());
  });
  return plot;
}

void sort_by_y(PlotSeries& series) {
  std::vector<std::pair<double, int>> both;
  for (std::size_t i = 0; i < series.y.size(); ++i) {
    both.emplace_back(series.y[i], series.runs[i]);
  }
  std::sort(both.begin(), both.end());
  for (std::size_t i = 0; i < both.size(); ++i) {
    series.y[i] = both[i].first;
    series.runs[i] = both[i].second;
  }
}

// Plots the sorted residuals against the normal quantiles at Blom's plotting positions.
Plot normal_plot(const Calibration& calibration) {
  Plot plot{.id = "residuals-normal",
            .title = "Normal plot of the residuals",
            .alternative =
                "Sorted residuals, divided by their standard deviation, against normal "
                "quantiles; they should lie along the line",
            .x_label = "normal quantile",
            .y_label = "residual / standard deviation"};
  double reach = 0.0;
  for (PlotSeries& series : series_by_axis(
           calibration, [](const ReadingResidual&) { return std::optional<double>(0.0); })) {
    sort_by_y(series);
    const auto n = static_cast<double>(series.y.size());
    double squares = 0.0;
    for (const double value : series.y) {
      squares += value * value;
    }
    const double sd = std::sqrt(squares / std::max(1.0, n));
    for (std::size_t i = 0; i < series.y.size(); ++i) {
      series.x[i] = normal_quantile((static_cast<double>(i) + 1.0 - 0.375) / (n + 0.25));
      series.y[i] /= sd > 0.0 ? sd : 1.0;
      reach = std::max(reach, std::abs(series.x[i]));
    }
    plot.series.push_back(std::move(series));
  }
  plot.series.push_back(
      {.name = "normal", .line = true, .x = {-reach, reach}, .y = {-reach, reach}});
  return plot;
}

// Returns the mean number of parameters in the regression of one axis: the sum of all leverages
// divided by the number of axes.
double parameters_of_axis(const Eigen::MatrixXd& leverage) {
  const double sum = leverage.array().isFinite().select(leverage.array(), 0.0).sum();
  return leverage.cols() > 0 ? sum / static_cast<double>(leverage.cols()) : 0.0;
}

Plot leverage_plot(const Calibration& calibration) {
  Plot plot{.id = "leverage",
            .title = "Leverage and studentised residuals, with Cook's distances 0.5 and 1",
            .alternative =
                "Studentised residual of each regression row against its leverage; a "
                "row beyond the curves changes the result considerably",
            .x_label = "leverage",
            .y_label = "studentised residual"};
  const FitStatistics& statistics = *calibration.fit.statistics;
  double largest = 0.0;
  double in_sight = 0.0;  // limit up to which the curves are drawn: three times the largest
                          // residual
  for (Eigen::Index k = 0; k < calibration.sensor.instrument.axis_count(); ++k) {
    PlotSeries series{.name = axis_name(calibration, k)};
    for (Eigen::Index i = 0; i < statistics.studentized.rows(); ++i) {
      const double residual = statistics.studentized(i, k);
      if (std::isfinite(residual)) {
        const double leverage = statistics.leverage(i, k);
        series.x.push_back(leverage);
        series.y.push_back(residual);
        series.runs.push_back(statistics.rows[static_cast<std::size_t>(i)].runs.front());
        largest = std::max(largest, leverage);
        in_sight = std::max(in_sight, 3.0 * std::abs(residual));
      }
    }
    plot.series.push_back(std::move(series));
  }
  const double parameters = parameters_of_axis(statistics.leverage);
  const double nu = calibration.fit.statistics->degrees_of_freedom.minCoeff();
  for (const double distance : {0.5, 1.0}) {
    PlotSeries curve{.name = "Cook's distance " + number_text(distance), .line = true};
    for (const double side : {1.0, -1.0}) {
      for (int i = 0; i <= 40; ++i) {
        const double h = largest * (0.3 + 0.75 * i / 40.0);
        if (h > 0.0 && h < 1.0) {
          curve.x.push_back(h);
          // The curve is a contour of Cook's distance, which depends on the internally studentised
          // residual r. The plot shows the externally studentised residual t, so r is converted by
          // t^2 = r^2 (nu - 1) / (nu - r^2), which requires r^2 < nu.
          const double r_squared = distance * parameters * (1.0 - h) / h;
          const double t =
              r_squared < nu ? std::sqrt(r_squared * (nu - 1.0) / (nu - r_squared)) : std::nan("");
          curve.y.push_back(t < in_sight ? side * t : std::nan(""));
        }
      }
      curve.x.push_back(largest);
      curve.y.push_back(std::nan(""));
    }
    plot.series.push_back(std::move(curve));
  }
  return plot;
}

}  // namespace

std::vector<Plot> residual_plots(const Calibration& calibration, const Observations* observations) {
  std::vector<Plot> plots;
  const std::string label = formatted("residual [{}]", calibration.sensor.instrument.unit);
  const auto add = [&](const std::string& id, const std::string& title, const std::string& words,
                       const std::string& x_label, std::vector<PlotSeries> series) {
    if (differ_along_x(series)) {
      plots.push_back({.id = id,
                       .title = title,
                       .alternative = words,
                       .x_label = x_label,
                       .y_label = label,
                       .series = std::move(series)});
    }
  };
  add("residuals-by-run", "Residuals by run",
      "Residual of each reading in the order taken, one series for each axis", "run",
      series_by_axis(calibration,
                     [](const ReadingResidual& r) { return std::optional<double>(r.run); }));
  if (plots.empty()) {
    return plots;
  }
  Plot faces = by_face(calibration, label);
  if (differ_along_x(faces.series)) {
    plots.push_back(std::move(faces));
  }
  if (observations != nullptr) {
    std::map<int, double> time_of_run;
    std::vector<double> times;
    for (const Reading& reading : observations->readings) {
      if (reading.time_s) {
        time_of_run[reading.run] = *reading.time_s;
        times.push_back(*reading.time_s);
      }
    }
    if (have_breaks(times)) {
      const double first = *std::min_element(times.begin(), times.end());
      add("residuals-by-time", "Residuals against time",
          "Residual of each reading against the time at which it was taken",
          "time since the first reading [s]",
          series_by_axis(calibration, [&](const ReadingResidual& r) -> std::optional<double> {
            const auto found = time_of_run.find(r.run);
            return found == time_of_run.end() ? std::nullopt : std::optional(found->second - first);
          }));
    }
  }
  add("residuals-by-temperature", "Residuals against temperature",
      "Residual of each reading against the sensor's temperature", "temperature",
      series_by_axis(calibration, [](const ReadingResidual& r) {
        return r.temperature ? std::optional(r.temperature->mean()) : std::nullopt;
      }));
  const FitStatistics* const statistics =
      calibration.fit.statistics ? &*calibration.fit.statistics : nullptr;
  // With fewer than four degrees of freedom, the residuals are determined more by the constraints
  // of the fit than by the noise. A studentised residual can then have any value.
  constexpr double fewest = 4.0;
  if (statistics == nullptr || statistics->degrees_of_freedom.minCoeff() >= fewest) {
    plots.push_back(normal_plot(calibration));
  }
  if (statistics != nullptr && !statistics->rows.empty() &&
      statistics->degrees_of_freedom.minCoeff() >= fewest) {
    Plot leverage = leverage_plot(calibration);
    if (differ_along_x(leverage.series)) {
      plots.push_back(std::move(leverage));
    }
  }
  return plots;
}

}  // namespace axiscal
