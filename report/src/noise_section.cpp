// SPDX-License-Identifier: Apache-2.0
#include "report/src/noise_section.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/logs/noise_summary.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/report/noise_report.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/html_page.hpp"

namespace axiscal {
namespace {

// Up to six columns of the same kind and unit. They share one table and one chart.
using NoiseGroup = std::vector<const ColumnNoise*>;

std::vector<NoiseGroup> groups_of(const LogNoise& noise) {
  std::vector<NoiseGroup> groups;
  for (const ColumnNoise& column : noise.columns) {
    const auto same = std::find_if(groups.begin(), groups.end(), [&](const NoiseGroup& group) {
      return group.front()->kind == column.kind && group.front()->unit == column.unit &&
             group.size() < 6;
    });
    if (same == groups.end()) {
      groups.push_back({&column});
    } else {
      same->push_back(&column);
    }
  }
  return groups;
}

// Returns true for a column of temperatures. Their Allan deviation shows the changes of the room's
// temperature, not noise.
bool is_temperature(const ColumnNoise& column) {
  const std::string name = to_lower_case(column.name);
  return column.kind == "temperature" || name.find("temp") != std::string::npos ||
         name.ends_with("degc");
}

std::string group_name(const NoiseGroup& group) {
  std::string name = group.front()->kind.empty() ? "Sensor" : group.front()->kind;
  name.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(name.front())));
  return name;
}

Cell sheet_cell(const SheetNoise& noise) {
  return {sheet_text(noise), noise.value > 0.0 ? number_text(noise.value) : std::string()};
}

std::string coefficients_of(const NoiseGroup& group) {
  constexpr std::array kinds = {std::pair(NoiseKind::white, "N"),
                                std::pair(NoiseKind::bias_instability, "B"),
                                std::pair(NoiseKind::random_walk, "K")};
  std::vector<std::string> head = {"axis"};
  for (const auto& [kind, name] : kinds) {
    head.push_back(formatted("{} [{}]", name, sheet_noise(*group.front(), kind).unit));
  }
  head.emplace_back("dwell [s]");
  std::vector<std::vector<Cell>> rows;
  for (const ColumnNoise* const column : group) {
    rows.push_back({{column->name, ""}});
    for (const auto& [kind, name] : kinds) {
      rows.back().push_back(sheet_cell(sheet_noise(*column, kind)));
    }
    rows.back().push_back(number_cell(column->dwell.sensible_s, 3));
  }
  return html_table(
      group_name(group) +
          ": white noise N, bias instability B, random walk K, with 95 % intervals in "
          "brackets; recommended dwell time at a design point",
      head, rows);
}

// Marks the points of the curve from which data sheets take the coefficients: N (white noise) at
// 1 s, K (random walk) at 3 s, and B (bias instability) at the lowest point.
void mark_coefficients(const ColumnNoise& column, Plot& plot, PlotSeries& marks) {
  double lowest_tau = 0.0;
  double lowest = 0.0;
  for (const AllanPoint& point : column.curve) {
    const double fitted = column.model.deviation_at(point.tau_s);
    if (fitted > 0.0 && (lowest == 0.0 || fitted < lowest)) {
      lowest = fitted;
      lowest_tau = point.tau_s;
    }
  }
  const double flat = std::sqrt(2.0 * std::log(2.0) / std::numbers::pi);
  for (const auto& [kind, letter, tau, factor] :
       {std::tuple(NoiseKind::white, "N", 1.0, 1.0),
        std::tuple(NoiseKind::bias_instability, "B", lowest_tau, flat),
        std::tuple(NoiseKind::random_walk, "K", 3.0, 1.0)}) {
    const double value = column.model.coefficient(kind);
    if (value > 0.0 && tau > 0.0) {
      marks.x.push_back(tau);
      marks.y.push_back(factor * value);
      plot.labels.push_back({.x = tau, .y = factor * value, .text = letter});
    }
  }
}

Plot allan_plot(const NoiseGroup& group, std::size_t number) {
  const std::string& unit = group.front()->unit;
  Plot plot{.id = formatted("allan-{}", number),
            .title = formatted("Allan deviation, {}",
                               group.front()->kind.empty() ? "sensor" : group.front()->kind),
            .alternative =
                "Overlapping Allan deviation of each axis as points with their 68 % "
                "band, the fitted noise model as a line, and the points at which N, B and K are "
                "read",
            .x_label = "averaging time [s]",
            .y_label = formatted("Allan deviation [{}]", unit.empty() ? "unit" : unit),
            .logarithmic = true};
  std::vector<PlotSeries> bands;
  std::vector<PlotSeries> points;
  std::vector<PlotSeries> fits;
  PlotSeries marks{.name = "N at 1 s, B at the lowest point, K at 3 s", .style = group.size()};
  for (std::size_t k = 0; k < group.size(); ++k) {
    const ColumnNoise* const column = group[k];
    PlotSeries band{.name = "68 %", .in_legend = k == 0};
    PlotSeries measured{.name = column->name, .style = k};
    PlotSeries fitted{.name = "fitted", .line = true, .style = k, .in_legend = k == 0};
    for (const AllanPoint& point : column->curve) {
      if (!(point.deviation > 0.0) || !(point.low > 0.0)) {
        continue;
      }
      band.x.push_back(point.tau_s);
      band.y.push_back(point.low);
      band.high.push_back(point.high);
      measured.x.push_back(point.tau_s);
      measured.y.push_back(point.deviation);
      const double model = column->model.deviation_at(point.tau_s);
      if (model > 0.0 && point.tau_s >= column->model.from_tau_s) {
        fitted.x.push_back(point.tau_s);
        fitted.y.push_back(model);
      }
    }
    const std::size_t labels = k == 0 ? std::string::npos : plot.labels.size();
    mark_coefficients(*column, plot, marks);
    plot.labels.resize(std::min(labels, plot.labels.size()));  // only the first column is labelled
    bands.push_back(std::move(band));
    points.push_back(std::move(measured));
    fits.push_back(std::move(fitted));
  }
  for (std::vector<PlotSeries>* const layer : {&bands, &points, &fits}) {
    std::move(layer->begin(), layer->end(), std::back_inserter(plot.series));
  }
  if (!marks.x.empty()) {
    plot.series.push_back(std::move(marks));
  }
  return plot;
}

}  // namespace

std::string noise_section(const LogNoise& noise, Figures& figures) {
  std::string html;
  for (const std::string& warning : noise.warnings) {
    html += paragraph(warning);
  }
  std::size_t number = 0;
  for (const NoiseGroup& group : groups_of(noise)) {
    html += coefficients_of(group);
    if (!is_temperature(*group.front())) {
      html += figures.add(allan_plot(group, ++number));
    }
  }
  return html;
}

std::string noise_report(const LogNoise& noise, const std::string& source) {
  Figures figures;
  std::string body = section("noise", "Noise", noise_section(noise, figures));
  return html_page(
      {.title = "Noise of " + source.substr(source.find_last_of('/') + 1),
       .subtitle =
           noise.samples > 0
               ? formatted("{} samples at {} Hz, {} s; {}", noise.samples,
                           number_text(noise.rate_hz, 6),
                           number_text(static_cast<double>(noise.samples) / noise.rate_hz, 4),
                           software_name())
               : std::string(software_name()),
       .body = std::move(body)});
}

}  // namespace axiscal
