// SPDX-License-Identifier: Apache-2.0
#include "report/src/report_plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"

namespace axiscal {
namespace {

bool has_angles(const Calibration& calibration) {
  return find_instrument_kind(calibration.sensor.instrument.kind).has_axis_elevation;
}

bool can_propagate(const Calibration& calibration) {
  return gives_field(calibration) && calibration.fit.statistics &&
         calibration.sensor.instrument.axis_count() >= 3 &&
         calibration.fit.statistics->covariance.size() > 0 &&
         calibration.fit.statistics->covariance.allFinite() &&
         calibration.fit.statistics->residual_sd.allFinite();
}

HeatMap map_of(const std::string& id, const std::string& title, const std::string& what) {
  return {.id = id,
          .title = title,
          .alternative = title + ", in colours; the table has the numbers",
          .x_label = "roll [deg]",
          .y_label = "pitch [deg]",
          .value_label = what};
}

}  // namespace

namespace {

constexpr double milli = 1e3;

// Returns the points and lines of a plot of the table's slope [mrad]: the slope measured with each
// face, the mean of these slopes, and the 95 % ellipse of the mean.
std::vector<PlotSeries> faces_and_mean(const Levelness& level) {
  PlotSeries estimates{.name = "one face"};
  for (const LevelnessEstimate& estimate : level.estimates) {
    estimates.x.push_back(milli * estimate.x);
    estimates.y.push_back(milli * estimate.y);
  }
  std::vector<PlotSeries> series = {
      std::move(estimates),
      {.name = "mean", .x = {milli * level.mean_x}, .y = {milli * level.mean_y}}};
  if (std::isfinite(level.standard_error_x) && level.degrees_of_freedom >= 1.0) {
    // Joint 95 % confidence ellipse of x and y (Hotelling). Its half axes are k standard errors
    // with k^2 = 2 F(0.95; 2, dof). For two dimensions, this quantile of the F distribution has the
    // closed form below.
    const double dof = level.degrees_of_freedom;
    const double k = std::sqrt(dof * (std::pow(0.05, -2.0 / dof) - 1.0));
    PlotSeries ellipse{.name = "95 % ellipse of the mean", .line = true};
    for (int i = 0; i <= 72; ++i) {
      const double turn = 2.0 * std::numbers::pi * i / 72.0;
      ellipse.x.push_back(milli * (level.mean_x + k * level.standard_error_x * std::cos(turn)));
      ellipse.y.push_back(milli * (level.mean_y + k * level.standard_error_y * std::sin(turn)));
    }
    series.push_back(std::move(ellipse));
  }
  return series;
}

Plot plot_of_table(const Calibration& calibration,
                   const std::string& id,
                   const std::string& title) {
  const bool slope = field_kind(calibration.sensor.field.kind).vertical;
  Plot plot{.id = id, .title = title, .equal_aspect = true};
  plot.x_label = slope ? "rises towards +x [mrad]" : "field along x / magnitude [1/1000]";
  plot.y_label = slope ? "rises towards +y [mrad]" : "field along y / magnitude [1/1000]";
  return plot;
}

}  // namespace

std::optional<Plot> slope_plot(const Calibration& calibration) {
  if (!calibration.fit.levelness || calibration.fit.levelness->estimates.empty()) {
    return std::nullopt;
  }
  const Levelness& level = *calibration.fit.levelness;
  Plot plot = plot_of_table(calibration, "slope-plot",
                            field_kind(calibration.sensor.field.kind).vertical
                                ? "Slope of the table"
                                : "Field in the table's plane");
  plot.alternative =
      "The table's slope as a line from the level position, the slope estimated from each face, "
      "and the 95 % ellipse of the mean";
  plot.narrow = true;
  plot.series = faces_and_mean(level);
  plot.series.push_back({.name = "slope",
                         .line = true,
                         .x = {0.0, milli * level.mean_x},
                         .y = {0.0, milli * level.mean_y}});
  plot.labels = {{.x = 0.0, .y = 0.0, .text = "level"}};
  return plot;
}

std::optional<Plot> faces_plot(const Calibration& calibration) {
  if (!calibration.fit.levelness || calibration.fit.levelness->estimates.size() < 2) {
    return std::nullopt;
  }
  const Levelness& level = *calibration.fit.levelness;
  Plot plot = plot_of_table(calibration, "levelness-plot", "The table's slope by face");
  plot.alternative =
      "Estimates of the table's slope along x and y from each face, the mean of these estimates, "
      "and the 95 % ellipse of the mean";
  plot.series = faces_and_mean(level);
  for (const LevelnessEstimate& estimate : level.estimates) {
    plot.labels.push_back({.x = milli * estimate.x,
                           .y = milli * estimate.y,
                           .text = typographic_face(face_name(estimate.point.rest()))});
  }
  return plot;
}

std::optional<BarPlot> budget_plot(const Calibration& calibration) {
  if (!can_propagate(calibration)) {
    return std::nullopt;
  }
  const Eigen::Vector3d field =
      has_angles(calibration)
          ? field_of_attitude(calibration.sensor, 20.0 * rad_per_deg, 30.0 * rad_per_deg)
          : Eigen::Vector3d(calibration.sensor.field.magnitude *
                            Eigen::Vector3d(1, 1, 1).normalized());
  const AttitudeBudget budget = attitude_budget(calibration, {}, stated_noise(calibration), field);
  BarPlot plot{.id = "budget-plot",
               .title = has_angles(calibration)
                            ? "Uncertainty of one reading by source, at pitch 20, roll 30 degrees"
                            : "Uncertainty of one reading by source, at equal field components",
               .alternative = "Standard uncertainty of each quantity by source",
               .series = {}};
  for (const std::string& source : budget.sources) {
    plot.series.push_back(source == "fit"       ? "coefficients"
                          : source == "reading" ? "noise of the reading"
                                                : source);
  }
  const std::string unit = has_angles(calibration) ? "deg" : calibration.sensor.field.unit;
  plot.value_label = formatted("standard uncertainty [{}]", unit);
  for (const AttitudeQuantity& quantity : budget.quantities) {
    const bool is_angle = quantity.name.ends_with("_deg");
    if (is_angle == has_angles(calibration) && quantity.name != "residual" &&
        std::isfinite(quantity.value)) {
      plot.names.push_back(is_angle ? quantity.name.substr(0, quantity.name.size() - 4)
                                    : quantity.name);
      plot.values.push_back(quantity.uncertainty.by_source);
    }
  }
  // A budget with one source has nothing to compare, so it gets no plot.
  return plot.names.empty() || plot.series.size() < 2 ? std::nullopt : std::optional(plot);
}

namespace {

std::vector<HeatMap> maps_of(const Calibration& calibration) {
  if (!can_propagate(calibration)) {
    return {};
  }
  std::vector<HeatMap> maps;
  if (has_angles(calibration)) {
    maps = {map_of("map-pitch", "Expanded uncertainty U (95 %) of pitch over attitudes", "U [deg]"),
            map_of("map-roll", "Expanded uncertainty U (95 %) of roll over attitudes", "U [deg]")};
    for (double roll = -180.0; roll <= 180.0; roll += 15.0) {
      maps[0].x.push_back(roll);
    }
    maps[1].x = maps[0].x;
    for (double pitch = -80.0; pitch <= 80.0; pitch += 10.0) {
      for (HeatMap& map : maps) {
        map.y.push_back(pitch);
        map.values.emplace_back();
      }
      for (const double roll : maps[0].x) {
        const AttitudeBudget budget = attitude_budget(
            calibration, {}, stated_noise(calibration),
            field_of_attitude(calibration.sensor, pitch * rad_per_deg, roll * rad_per_deg));
        for (const AttitudeQuantity& quantity : budget.quantities) {
          if (quantity.name == "pitch_deg") {
            maps[0].values.back().push_back(quantity.uncertainty.expanded);
          } else if (quantity.name == "roll_deg") {
            maps[1].values.back().push_back(quantity.uncertainty.expanded);
          }
        }
      }
    }
    return maps;
  }
  const Reducer reducer(calibration, {}, Force::yes);
  const ReadingPropagation propagation(calibration, reducer, stated_noise(calibration));
  HeatMap map =
      map_of("map-direction",
             "Expanded uncertainty U (95 %) of the field's direction, over directions", "U [deg]");
  map.x_label = "azimuth in the instrument's frame [deg]";
  map.y_label = "elevation [deg]";
  for (double azimuth = -180.0; azimuth <= 180.0; azimuth += 15.0) {
    map.x.push_back(azimuth);
  }
  for (double elevation = -90.0; elevation <= 90.0; elevation += 10.0) {
    map.y.push_back(elevation);
    map.values.emplace_back();
    for (const double azimuth : map.x) {
      const double up = elevation * rad_per_deg;
      const double around = azimuth * rad_per_deg;
      map.values.back().push_back(direction_uncertainty_deg(
          calibration, propagation,
          {std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up)}));
    }
  }
  return {map};
}

// Returns true if all values of a map are nearly equal, so that the map is not needed.
bool is_flat(const HeatMap& map) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const std::vector<double>& row : map.values) {
    for (const double value : row) {
      low = std::fmin(low, value);
      high = std::fmax(high, value);
    }
  }
  constexpr double tellable = 1.05;
  return !(high > tellable * low);
}

}  // namespace

std::vector<HeatMap> uncertainty_maps(const Calibration& calibration) {
  std::vector<HeatMap> maps = maps_of(calibration);
  maps.erase(std::remove_if(maps.begin(), maps.end(), is_flat), maps.end());
  return maps;
}

WorstAngleUncertainty worst_angle_uncertainty(const Calibration& calibration) {
  WorstAngleUncertainty worst{.quantity = "direction of the field", .expanded_deg = std::nan("")};
  double largest = -1.0;
  for (const HeatMap& map : maps_of(calibration)) {
    for (const std::vector<double>& row : map.values) {
      for (const double value : row) {
        if (value > largest) {
          largest = value;
          worst.expanded_deg = value;
          worst.quantity = map.id == "map-pitch"  ? "pitch"
                           : map.id == "map-roll" ? "roll"
                                                  : "direction of the field";
        }
      }
    }
  }
  return worst;
}

std::vector<Plot> temperature_plots(const Calibration& calibration) {
  if (!calibration.sensor.temperature) {
    return {};
  }
  const TemperatureResponse& over = *calibration.sensor.temperature;
  std::vector<Plot> plots;
  for (const bool is_bias : {true, false}) {
    Plot plot{.id = is_bias ? "temperature-bias" : "temperature-scale",
              .title = is_bias ? "Bias over temperature, minus the bias at the reference "
                                 "temperature"
                               : "Scale over temperature",
              .alternative =
                  "Curve of each axis over the calibrated range, with its 95 % band, and "
                  "extrapolated by a fifth of the range at both ends",
              .x_label = "temperature",
              .y_label = is_bias
                             ? formatted("change of bias [{}]", calibration.sensor.instrument.unit)
                             : "scale"};
    for (Eigen::Index k = 0; k < over.bias.rows(); ++k) {
      const TemperatureSpan& span = over.span_of(k);
      const double margin = 0.2 * (span.high - span.low);
      PlotSeries within{.name = axis_name(calibration, k), .line = true};
      PlotSeries below{.name = axis_name(calibration, k) + ", extrapolated", .line = true};
      PlotSeries band{.name = axis_name(calibration, k) + ", 95 %"};
      for (int i = 0; i <= 70; ++i) {
        const double t = span.low - margin + (span.high - span.low + 2.0 * margin) * i / 70.0;
        const bool extrapolated = t < span.low || t > span.high;
        const double value = is_bias ? over.bias_shift(k, t) : over.scale_at(k, t);
        PlotSeries& series = extrapolated ? below : within;
        series.x.push_back(t);
        series.y.push_back(value);
        if (!calibration.fit.statistics || extrapolated) {
          continue;
        }
        // Derivatives of the curve at this temperature with respect to the temperature
        // coefficients.
        Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(
            static_cast<Eigen::Index>(calibration.fit.statistics->parameter_names.size()));
        double power = 1.0;
        for (Eigen::Index order = 0; order < over.bias.cols(); ++order) {
          power *= t - span.reference;
          const std::string name = axis_name(calibration, k) + (is_bias ? ".bias.d" : ".scale.d") +
                                   (order == 0 ? "" : std::to_string(order + 1));
          if (const auto at = calibration.fit.statistics->position_of(name)) {
            gradient(*at) = power;
          }
        }
        const double expanded = propagate(calibration, gradient).expanded;
        if (std::isfinite(expanded)) {
          band.x.push_back(t);
          band.y.push_back(value - expanded);
          band.high.push_back(value + expanded);
        }
      }
      if (!band.x.empty()) {
        plot.series.push_back(std::move(band));
      }
      plot.series.push_back(std::move(within));
      // Interrupts the line of the extrapolation within the calibrated temperature range.
      const auto gap =
          std::find_if(below.x.begin(), below.x.end(), [&](double t) { return t > span.high; });
      const auto cut = gap - below.x.begin();
      below.x.insert(gap, span.high);
      below.y.insert(below.y.begin() + cut, std::nan(""));
      plot.series.push_back(std::move(below));
    }
    plots.push_back(std::move(plot));
  }
  return plots;
}

std::optional<Plot> magnitude_plot(const Calibration& calibration) {
  if (!method_kind(calibration.fit.method).by_magnitude || !gives_field(calibration) ||
      calibration.sensor.instrument.axis_count() != 3) {
    return std::nullopt;
  }
  PlotSeries magnitudes{.name = "|f| \u2212 F"};
  for (const ReadingResidual& residual : calibration.fit.residuals) {
    if (residual.used && std::isfinite(residual.magnitude)) {
      magnitudes.x.push_back(residual.run);
      magnitudes.y.push_back(residual.magnitude);
      magnitudes.runs.push_back(residual.run);
    }
  }
  return Plot{.id = "magnitude-by-run",
              .title = "Magnitude of the field, by run",
              .alternative = "Magnitude of each calibrated reading minus that of the field",
              .x_label = "run",
              .y_label = formatted("|f| \u2212 F [{}]", calibration.sensor.field.unit),
              .series = {std::move(magnitudes)}};
}

std::vector<Plot> turn_plots(const Calibration& calibration) {
  if (calibration.fit.turn_errors_rad.empty()) {
    return {};
  }
  Plot plot{
      .id = "turns-plot",
      .title = "Attitude error after each turn between two rests",
      .alternative =
          "Attitude error of the calibrated gyroscope, integrated over each turn, about x, y and z",
      .x_label = "turn",
      .y_label = "attitude error [deg]"};
  for (Eigen::Index k = 0; k < 3; ++k) {
    PlotSeries series{.name = "about " + std::string(1, "xyz"[k])};
    for (const Eigen::Vector3d& error : calibration.fit.turn_errors_rad) {
      series.x.push_back(static_cast<double>(series.x.size()) + 1.0);
      series.y.push_back(error(k) * deg_per_rad);
    }
    plot.series.push_back(std::move(series));
  }
  return {plot};
}

std::vector<Plot> history_plots(const UnitHistory& unit) {
  std::vector<Plot> plots;  // one plot for each axis
  for (const ParameterTrend& trend : unit.trends) {
    PlotSeries series{.name = trend.parameter};
    for (std::size_t i = 0; i < trend.values.size(); ++i) {
      const double u = std::hypot(trend.u[i], trend.u[0]);
      if (std::isfinite(u) && u > 0.0) {
        series.x.push_back(static_cast<double>(i));
        series.y.push_back((trend.values[i] - trend.values[0]) / u);
      }
    }
    if (series.x.empty()) {
      continue;
    }
    const std::string axis = trend.parameter.substr(0, trend.parameter.find('.'));
    const std::string id = "history-" + axis;
    if (plots.empty() || plots.back().id != id) {
      Plot& plot = plots.emplace_back(Plot{
          .id = id,
          .title = formatted("Axis {}: coefficients since the first record", axis),
          .alternative = formatted("Change of each coefficient of axis {} since the first record, "
                                   "in standard uncertainties of the change",
                                   axis),
          .x_label = "record",
          .y_label = "change / standard uncertainty"});
      for (const std::string& date : unit.dates) {
        plot.x_names.push_back(date.substr(0, 10));
      }
    }
    plots.back().series.push_back(std::move(series));
  }
  return plots;
}

}  // namespace axiscal
