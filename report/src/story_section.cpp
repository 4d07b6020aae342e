// SPDX-License-Identifier: Apache-2.0
#include "report/src/story_section.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "axiscal/positioner/positioner.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/report_plots.hpp"

namespace axiscal {
namespace {

// ---- Figure: measured against expected values ----

// Returns the reading that the fit predicts; nullopt if the record lacks data for the prediction.
std::optional<Eigen::VectorXd> expected_at(const Calibration& calibration,
                                           const ReadingResidual& residual) {
  const FieldDescription& field = calibration.sensor.field;
  // In all but this simple case, a prediction needs the observations, which are not in the record.
  if (!residual.point || !field.in_table || residual.level || !calibration.sensor.also.empty() ||
      calibration.sensor.temperature || !calibration.provenance.positioner.empty() ||
      !calibration.provenance.slot.empty()) {
    return std::nullopt;
  }
  static const Positioner cube;
  const Eigen::Vector3d in_sensor =
      cube.rotation_table_from_positioner(*residual.point).transpose() * *field.in_table;
  return calibration.sensor.response.bias + calibration.sensor.response.sensitivity * in_sensor;
}

std::optional<Plot> measured_plot(const Calibration& calibration,
                                  const Observations* observations) {
  std::map<int, Eigen::Index> row_of_run;
  for (std::size_t i = 0; observations != nullptr && i < observations->readings.size(); ++i) {
    row_of_run[observations->readings[i].run] = static_cast<Eigen::Index>(i);
  }
  const std::string& unit = calibration.sensor.instrument.unit;
  Plot plot{.id = "measured-plot",
            .title = "Measured against expected",
            .alternative =
                "Each reading against the value predicted by the fit, one series for each axis; "
                "the points should lie along the line",
            .x_label = formatted("expected [{}]", unit),
            .y_label = formatted("measured [{}]", unit),
            .narrow = true};
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < calibration.sensor.instrument.axis_count(); ++k) {
    PlotSeries series{.name = axis_name(calibration, k)};
    for (const ReadingResidual& residual : calibration.fit.residuals) {
      if (k >= residual.response.size() || !std::isfinite(residual.response(k))) {
        continue;
      }
      double expected = std::nan("");
      const auto row = row_of_run.find(residual.run);
      if (row != row_of_run.end() && k < observations->response.cols()) {
        expected = observations->response(row->second, k) - residual.response(k);
      } else if (const auto by_pose = expected_at(calibration, residual)) {
        expected = (*by_pose)(k);
      }
      if (std::isfinite(expected)) {
        series.x.push_back(expected);
        series.y.push_back(expected + residual.response(k));
        series.runs.push_back(residual.run);
        low = std::min({low, series.x.back(), series.y.back()});
        high = std::max({high, series.x.back(), series.y.back()});
        largest = residual.used ? std::max(largest, std::abs(residual.response(k))) : largest;
      }
    }
    plot.series.push_back(std::move(series));
  }
  if (!(high > low)) {
    return std::nullopt;
  }
  plot.series.push_back(
      {.name = "measured = expected", .line = true, .x = {low, high}, .y = {low, high}});
  const double share = largest / (high - low);
  plot.title += share < 1e-3 ? formatted(", within {} ppm", rounded(1e6 * share))
                             : formatted(", within {} %", rounded(1e2 * share));
  return plot;
}

// ---- Figure: the axes in space ----

// A point of the drawing. The drawing shows the axes as seen from the front, the right and above.
// x is to the right, z is up.
struct Seen {
  double x;
  double y;
};

Seen in_view(const Eigen::Vector3d& v) {
  constexpr double unit = 134.0;
  return {140.0 + unit * (0.92 * v.x() + 0.45 * v.y()),
          196.0 - unit * (v.z() + 0.42 * v.y() - 0.2 * v.x())};
}

// Returns the factor by which small angles are enlarged to be visible: 1, 2 or 5 times a power of
// ten.
double exaggeration_of(double largest_rad) {
  constexpr double wanted_rad = 0.3;
  if (!(largest_rad > 0.0) || largest_rad >= wanted_rad) {
    return 1.0;
  }
  const double raw = wanted_rad / largest_rad;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / power;
  return power * (lead >= 5.0 ? 5.0 : lead >= 2.0 ? 2.0 : 1.0);
}

std::string arrow_to(const Eigen::Vector3d& tip, std::size_t series) {
  const Seen from = in_view(Eigen::Vector3d::Zero());
  const Seen to = in_view(tip);
  return formatted(
      "<line class=\"axis s{}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>"
      "<circle class=\"mark s{}\" cx=\"{}\" cy=\"{}\" r=\"4.5\"/>",
      series, svg_number(from.x), svg_number(from.y), svg_number(to.x), svg_number(to.y), series,
      svg_number(to.x), svg_number(to.y));
}

std::string axes_figure(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  const Eigen::MatrixXd& S = calibration.sensor.response.sensitivity;
  if (!gives_field(calibration) || S.rows() > 6) {
    return "";
  }
  struct Sensing {
    Eigen::Vector3d nominal;
    Eigen::Vector3d direction;
    double off_rad = 0.0;
  };
  std::vector<Sensing> all;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < S.rows(); ++k) {
    const int main = main_axis(instrument, calibration.sensor.response, k);
    Sensing one{.nominal = Eigen::Vector3d::Unit(main) * (S(k, main) < 0.0 ? -1.0 : 1.0),
                .direction = S.row(k).transpose().normalized()};
    if (!one.direction.allFinite() || S.row(k).norm() == 0.0) {
      return "";
    }
    one.off_rad =
        std::atan2(one.nominal.cross(one.direction).norm(), one.nominal.dot(one.direction));
    largest = std::max(largest, one.off_rad);
    all.push_back(one);
  }
  const double times = exaggeration_of(largest);
  std::string svg =
      "<svg class=\"drawn\" viewBox=\"0 0 360 300\" role=\"img\" aria-label=\"The directions of "
      "the sensing axes and of the frame's axes; the table has the angles\">";
  for (int j = 0; j < 3; ++j) {
    const Seen from = in_view(-0.25 * Eigen::Vector3d::Unit(j));
    const Seen to = in_view(1.12 * Eigen::Vector3d::Unit(j));
    svg += formatted("<line class=\"frame\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>",
                     svg_number(from.x), svg_number(from.y), svg_number(to.x), svg_number(to.y));
    const Seen name = in_view(1.24 * Eigen::Vector3d::Unit(j));
    svg += formatted("<text class=\"tick middle\" x=\"{}\" y=\"{}\">{}</text>", svg_number(name.x),
                     svg_number(name.y + 4.0), "xyz"[j]);
  }
  std::vector<std::vector<Cell>> rows;
  std::string words;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Sensing& one = all[k];
    const Eigen::Vector3d turn = one.nominal.cross(one.direction);
    const Eigen::Vector3d drawn =
        turn.norm() > 0.0 ? Eigen::AngleAxisd(times * one.off_rad, turn.normalized()) * one.nominal
                          : one.nominal;
    svg += arrow_to(drawn, k);
    const std::string off = rounded(one.off_rad * deg_per_rad, 3);
    words += formatted(
        "<span><svg viewBox=\"0 0 12 12\" aria-hidden=\"true\"><circle "
        "class=\"mark s{}\" cx=\"6\" cy=\"6\" r=\"4\"/></svg>{}: {}\u00b0 off</span> ",
        k, escaped(instrument.axes[k]), off);
    rows.push_back({{instrument.axes[k], ""},
                    number_cell(one.direction.x(), 7),
                    number_cell(one.direction.y(), 7),
                    number_cell(one.direction.z(), 7),
                    number_cell(one.off_rad * deg_per_rad, 4)});
  }
  return formatted(
      "<figure id=\"axes-figure\"><figcaption>Sensing axes in space{}</figcaption><div "
      "class=\"plot\">{}</svg></div><p class=\"legend\">{}</p><details><summary>Data</summary>{}"
      "</details></figure>\n",
      times > 1.0 ? formatted(", angles enlarged {} times", number_text(times)) : "", svg, words,
      html_table("", {"axis", "x", "y", "z", "angle to nominal axis [deg]"}, rows));
}

// ---- Figure: the cloud of readings before and after the calibration ----

// The readings before the calibration, scaled to the field's unit, and after the calibration.
struct Cloud {
  Eigen::MatrixXd before;  // n x 3 [field unit]
  Eigen::MatrixXd after;
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();  // vector subtracted from `before`
};

Cloud cloud_of(const Calibration& calibration, const Observations& observations) {
  Cloud cloud;
  const Eigen::Index n = observations.response.rows();
  cloud.before.resize(n, 3);
  cloud.after.resize(n, 3);
  const SensorModel& sensor = calibration.sensor;
  // All axes are scaled by the same factor, so that an ellipsoid keeps its shape.
  const double scale = std::cbrt(std::abs(sensor.response.sensitivity.determinant()));
  const Eigen::Vector3d centre = sensor.response.bias / scale;
  constexpr double in_sight = 3.0;
  if (centre.norm() > in_sight * sensor.field.magnitude) {
    cloud.moved = centre;
  }
  const Reducer reducer(calibration, {}, Force::yes);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d v = observations.response.row(i).transpose();
    cloud.before.row(i) = (v / scale - cloud.moved).transpose();
    cloud.after.row(i) =
        reducer.reduce(std::array{v.x(), v.y(), v.z()}).field_in_sensor.transpose();
  }
  return cloud;
}

// Returns the remaining bias of the calibrated readings, divided by the field's magnitude. The
// sphere of directions is divided into regions of equal area. Every region with readings has the
// same weight, so that frequent directions do not dominate.
double wobble_of(const Eigen::MatrixXd& after, double magnitude) {
  constexpr int bands = 8;
  constexpr int sectors = 12;
  std::map<std::pair<int, int>, std::pair<Eigen::Vector3d, int>> regions;
  for (Eigen::Index i = 0; i < after.rows(); ++i) {
    const Eigen::Vector3d f = after.row(i).transpose();
    const Eigen::Vector3d direction = f.normalized();
    const auto band =
        std::clamp(static_cast<int>(0.5 * (direction.z() + 1.0) * bands), 0, bands - 1);
    const double around = std::atan2(direction.y(), direction.x()) / (2.0 * std::numbers::pi) + 0.5;
    const auto sector = std::clamp(static_cast<int>(around * sectors), 0, sectors - 1);
    auto& [sum, count] =
        regions.try_emplace({band, sector}, Eigen::Vector3d::Zero(), 0).first->second;
    sum += f - magnitude * direction;
    ++count;
  }
  // A remaining bias shifts all readings by the same vector. In each region, the mean deviation of
  // the magnitude is the component of this vector along the region's direction. A least-squares fit
  // over all regions gives the vector.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const auto& [region, sums] : regions) {
    const double z = (region.first + 0.5) * 2.0 / bands - 1.0;
    const double around = ((region.second + 0.5) / sectors - 0.5) * 2.0 * std::numbers::pi;
    const double level = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(level * std::cos(around), level * std::sin(around), z);
    const Eigen::Vector3d mean = sums.first / sums.second;
    normal += direction * direction.transpose();
    right += direction * direction.dot(mean);
  }
  return normal.ldlt().solve(right).norm() / magnitude;
}

Plot projection_of(const Calibration& calibration, const Cloud& cloud, int u, int v) {
  const std::string& unit = calibration.sensor.field.unit;
  const std::array<const char*, 3> names = {"x", "y", "z"};
  Plot plot{.id = formatted("cloud-{}{}", names[static_cast<std::size_t>(u)],
                            names[static_cast<std::size_t>(v)]),
            .title = formatted("Seen along {}", names[static_cast<std::size_t>(3 - u - v)]),
            .alternative =
                "The readings before and after calibration, and the circle for readings in this "
                "plane",
            .x_label = formatted("{} [{}]", names[static_cast<std::size_t>(u)], unit),
            .y_label = formatted("{} [{}]", names[static_cast<std::size_t>(v)], unit),
            .equal_aspect = true,
            .narrow = true};
  const auto points = [&](const std::string& name, const Eigen::MatrixXd& all) {
    PlotSeries series{.name = name};
    for (Eigen::Index i = 0; i < all.rows(); ++i) {
      series.x.push_back(all(i, u));
      series.y.push_back(all(i, v));
    }
    return series;
  };
  PlotSeries circle{.name = "sphere of the field", .line = true};
  for (int i = 0; i <= 90; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / 90.0;
    circle.x.push_back(calibration.sensor.field.magnitude * std::cos(turn));
    circle.y.push_back(calibration.sensor.field.magnitude * std::sin(turn));
  }
  plot.series = {
      points("after", cloud.after),
      points(cloud.moved.isZero() ? "before" : "before, moved to the origin", cloud.before),
      std::move(circle)};
  return plot;
}

std::string percent(double share) {
  return formatted("{} %", rounded(100.0 * share));
}

// Returns the numbers that compass calibration programs usually state.
std::string plain_numbers(const OrientationQuality& quality,
                          const Calibration& calibration,
                          const Cloud* cloud) {
  const FieldDescription& field = calibration.sensor.field;
  std::vector<std::array<std::string, 3>> numbers = {
      {"Gaps", percent(1.0 - quality.coverage),
       formatted(
           "of the sphere is farther than 30\u00b0 from every reading; the largest gap is {}\u00b0",
           rounded(quality.largest_gap_rad * deg_per_rad))},
      {"Fit error", percent(quality.fit_error),
       "of the field: rms difference of the calibrated magnitude from the field's magnitude"},
      {"Field", number_text(field.magnitude, 6) + (field.unit == "1" ? "" : " " + field.unit),
       formatted("as stated; the magnitudes scatter by {}", percent(quality.magnitude_spread))}};
  if (cloud != nullptr) {
    numbers.push_back({"Wobble", percent(wobble_of(cloud->after, field.magnitude)),
                       "of the field: offset of the sphere's centre after the calibration"});
  }
  std::string html = "<dl class=\"numbers\">";
  for (const auto& [name, value, words] : numbers) {
    html += formatted("<div><dt>{}</dt><dd><strong>{}</strong> {}</dd></div>", name, escaped(value),
                      escaped(words));
  }
  return html + "</dl>\n";
}

}  // namespace

std::string story_section(const Calibration& calibration,
                          const Observations* observations,
                          Figures& figures) {
  constexpr const char* three = "plots three";
  if (calibration.fit.orientations) {
    std::optional<Cloud> cloud;
    if (observations != nullptr && observations->response.cols() == 3 && gives_field(calibration)) {
      cloud = cloud_of(calibration, *observations);
    }
    std::string projections;
    if (cloud) {
      for (const auto& [u, v] : {std::pair(0, 1), std::pair(1, 2), std::pair(2, 0)}) {
        projections += figures.add(projection_of(calibration, *cloud, u, v));
      }
    } else {
      projections += axes_figure(calibration);
    }
    return plain_numbers(*calibration.fit.orientations, calibration, cloud ? &*cloud : nullptr) +
           Figures::side_by_side(projections, three);
  }
  std::string html;
  if (const std::optional<Plot> plot = measured_plot(calibration, observations)) {
    html += figures.add(*plot);
  }
  html += axes_figure(calibration);
  if (const std::optional<Plot> plot = slope_plot(calibration)) {
    html += figures.add(*plot);
  }
  return Figures::side_by_side(html, three);
}

}  // namespace axiscal
