// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/fleet_report.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"
#include "report/src/fleet_statistics.hpp"
#include "report/src/html.hpp"
#include "report/src/html_page.hpp"
#include "report/src/plot.hpp"

namespace axiscal {
namespace {

std::string share_text(double share) {
  return formatted("{:.1f} %", 100.0 * share);
}

Cell share_cell(const Share& share) {
  return {formatted("{} ({} to {})", share_text(share.value()), share_text(share.low),
                    share_text(share.high)),
          number_text(share.value(), 6)};
}

std::string named(const std::string& name) {
  return name.empty() ? "(not stated)" : name;
}

// The share of units that passed their first test, and the share that passed their last test.
struct Yield {
  Share first, last;
};

Yield yield_of(const FleetUnits& units) {
  std::size_t first = 0;
  std::size_t last = 0;
  for (const std::vector<const FleetTest*>& tests : units.tests) {
    first += tests.front()->passed ? 1U : 0U;
    last += tests.back()->passed ? 1U : 0U;
  }
  return {.first = share_of(first, units.tests.size()), .last = share_of(last, units.tests.size())};
}

std::string yield_section(const Fleet& fleet, const FleetUnits& units) {
  const Yield yield = yield_of(units);
  const auto text = [](const Share& share) {
    return formatted("{} of {} units, {} (95 % interval {} to {})", share.count, share.of,
                     share_text(share.value()), share_text(share.low), share_text(share.high));
  };
  return facts({{"Instrument", fleet.kind},
                {"Model", fleet.model},
                {"Units", std::to_string(units.tests.size())},
                {"Tests", std::to_string(fleet.tests.size())},
                {"First test passed", text(yield.first)},
                {"Last test passed", text(yield.last)},
                {"First and last date", formatted("{} to {}", units.last(0).date,
                                                  units.last(units.tests.size() - 1).date)}});
}

// Returns the section on the reasons for failures, with the most frequent reason first.
std::string pareto_section(const FleetUnits& units, Figures& figures) {
  std::map<std::string, std::size_t> reasons;
  std::size_t failed = 0;
  for (std::size_t unit = 0; unit < units.tests.size(); ++unit) {
    if (!units.last(unit).passed) {
      reasons[named(units.last(unit).reason)] += 1;
      ++failed;
    }
  }
  if (failed == 0) {
    return paragraph("All units passed their last test.");
  }
  std::vector<std::pair<std::string, std::size_t>> sorted(reasons.begin(), reasons.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  constexpr std::size_t most_bars = 12;
  BarPlot plot{.id = "pareto",
               .title = "Reasons of failures",
               .alternative = "Number of failed units for each reason, the most frequent first",
               .value_label = "units",
               .names = {},
               .series = {"units"},
               .values = {}};
  std::vector<std::vector<Cell>> rows;
  std::size_t sum = 0;
  for (const auto& [reason, count] : sorted) {
    sum += count;
    if (plot.names.size() < most_bars) {
      plot.names.push_back(reason);
      plot.values.push_back({static_cast<double>(count)});
    }
    rows.push_back({{reason, ""},
                    {std::to_string(count), ""},
                    {share_text(static_cast<double>(sum) / static_cast<double>(failed)), ""}});
    if (rows.size() == rows_of_page) {
      break;
    }
  }
  return figures.add(plot) + html_table(formatted("{} units failed their last test", failed),
                                        {"reason", "units", "sum"}, rows);
}

std::string limits_text(const FleetParameter& parameter) {
  if (!parameter.low && !parameter.high) {
    return "";
  }
  return formatted("{} to {}", parameter.low ? number_text(*parameter.low, 6) : "\u2212\u221e",
                   parameter.high ? number_text(*parameter.high, 6) : "\u221e");
}

std::string capability_section(const Fleet& fleet, const std::vector<Capability>& capabilities) {
  std::vector<std::vector<Cell>> rows;
  bool has_prior = false;
  for (std::size_t k = 0; k < capabilities.size(); ++k) {
    const Capability& one = capabilities[k];
    has_prior = has_prior || std::isfinite(one.median_u_with_prior);
    rows.push_back({{fleet.parameters[k].name, ""},
                    {std::to_string(one.units), ""},
                    rounded_cell(one.mean, one.sd),
                    number_cell(one.sd, 3),
                    number_cell(one.sd_within, 3),
                    {limits_text(fleet.parameters[k]), ""},
                    number_cell(one.cpk, 3),
                    number_cell(one.ppk, 3),
                    number_cell(one.ppk_low, 3),
                    number_cell(2.0 * one.median_u, 2),
                    number_cell(2.0 * one.median_u_with_prior, 2),
                    {std::to_string(one.outside), ""}});
  }
  std::string html =
      html_table("Coefficients of the last tests",
                 {"coefficient", "units", "mean", "sd", "sd within batches", "limits", "Cpk", "Ppk",
                  "Ppk (lower 95 % limit)", "2 u of a unit", "2 u with the batch", "outside 3 sd"},
                 rows);
  html += paragraph(
      "Cpk is the distance from the mean to the nearer limit, divided by three standard deviations "
      "within batches. Ppk uses the standard deviation of all units. Both include the uncertainty "
      "of the calibrations.");
  if (has_prior) {
    html += paragraph(
        "2 u with the batch: a unit of a known batch is likely to be close to the other units, so "
        "knowledge of the batch reduces the part of the uncertainty that comes from reading noise. "
        "The part that all units share remains. This applies only to units that belong to the "
        "batch; the records do not contain this value.");
  }
  return html;
}

// Returns a control chart for each coefficient. It shows the units in the order of their dates, the
// mean and the control limits.
std::vector<Plot> charts_by_time(const Fleet& fleet,
                                 const FleetUnits& units,
                                 const std::vector<Capability>& capabilities) {
  std::vector<Plot> plots;
  for (std::size_t k = 0; k < fleet.parameters.size(); ++k) {
    const Capability& one = capabilities[k];
    if (one.units < 2) {
      continue;
    }
    const std::string& name = fleet.parameters[k].name;
    PlotSeries points{.name = "units"};
    for (std::size_t unit = 0; unit < units.tests.size(); ++unit) {
      const FleetTest& test = units.last(unit);
      if (k < test.values.size() && std::isfinite(test.values[k])) {
        points.x.push_back(static_cast<double>(unit + 1));
        points.y.push_back(test.values[k]);
      }
    }
    const auto line = [&](const char* called, double y) {
      return PlotSeries{
          .name = called, .line = true, .x = {points.x.front(), points.x.back()}, .y = {y, y}};
    };
    Plot plot{.id = "chart-" + name,
              .title = formatted("{} by time", name),
              .alternative = formatted("{} of each unit in the order of the dates, with the mean "
                                       "and three standard deviations; {} units are outside",
                                       name, one.outside),
              .x_label = "unit, by date",
              .y_label = name,
              .series = {}};
    plot.series = {points, line("mean", one.center), line("mean \u2212 3 sd", one.below),
                   line("mean + 3 sd", one.above)};
    plots.push_back(std::move(plot));
  }
  return plots;
}

double largest_z(const FleetGroup& group) {
  double largest = 0.0;
  for (const double z : group.z) {
    largest = std::isfinite(z) ? std::max(largest, std::abs(z)) : largest;
  }
  return largest;
}

// Returns the section on groups of units: a control chart of the groups' means, and a table.
std::string groups_section(const Fleet& fleet,
                           const FleetUnits& units,
                           const std::vector<Capability>& capabilities,
                           const std::string FleetTest::*member,
                           const std::string& what,
                           Figures& figures) {
  std::vector<FleetGroup> groups = groups_of(units, capabilities, member);
  if (groups.empty()) {
    return "";
  }
  constexpr std::size_t most_groups = 40;
  const std::size_t all = groups.size();
  if (all > most_groups) {
    std::stable_sort(groups.begin(), groups.end(),
                     [](const auto& a, const auto& b) { return largest_z(a) > largest_z(b); });
    groups.resize(most_groups);
  }
  std::vector<std::vector<Cell>> rows;
  Plot plot{.id = "chart-" + what,
            .title = formatted("Means by {}", what),
            .alternative = formatted("Deviation of the mean of each {} from the mean of all units, "
                                     "in standard errors, for each coefficient",
                                     what),
            .x_label = what,
            .y_label = "deviation / standard error",
            .series = {}};
  for (std::size_t k = 0; k < fleet.parameters.size(); ++k) {
    plot.series.push_back({.name = fleet.parameters[k].name});
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const FleetGroup& group = groups[i];
    plot.x_names.push_back(named(group.name));
    std::size_t worst = 0;
    for (std::size_t k = 0; k < group.z.size(); ++k) {
      plot.series[k].x.push_back(static_cast<double>(i));
      plot.series[k].y.push_back(group.z[k]);
      worst = std::abs(group.z[k]) > std::abs(group.z[worst]) ? k : worst;
    }
    rows.push_back({{named(group.name), ""},
                    {std::to_string(group.passed.of), ""},
                    share_cell(group.passed),
                    {fleet.parameters.empty() ? "" : fleet.parameters[worst].name, ""},
                    number_cell(group.z.empty() ? std::nan("") : group.z[worst], 3)});
  }
  for (const double limit : {-3.0, 3.0}) {
    plot.series.push_back({.name = limit < 0.0 ? "\u22123" : "+3",
                           .line = true,
                           .x = {0.0, static_cast<double>(groups.size() - 1)},
                           .y = {limit, limit}});
  }
  std::string html = figures.add(plot);
  html += html_table(
      "", {what, "units", "passed (95 % interval)", "largest deviation of", "in standard errors"},
      rows);
  if (all > most_groups) {
    html +=
        paragraph(formatted("Only the {} of {} with the largest deviations are "
                            "shown.",
                            most_groups, all));
  }
  return html;
}

std::string retests_section(const FleetUnits& units) {
  const std::vector<Retest> retests = retests_of(units);
  if (retests.empty()) {
    return "";
  }
  std::map<RetestKind, std::size_t> counts;
  std::vector<std::vector<Cell>> rows;
  for (const Retest& one : retests) {
    counts[one.kind] += 1;
    if (one.kind != RetestKind::passed_both && rows.size() < rows_of_page) {
      rows.push_back({{one.first->serial, ""},
                      {one.first->date, ""},
                      {one.last->date, ""},
                      {name_of(one.kind), ""},
                      number_cell(one.largest_z, 3),
                      {one.last->passed ? one.first->reason : one.last->reason, ""}});
    }
  }
  std::vector<std::string> lines;
  for (const auto& [kind, count] : counts) {
    lines.push_back(formatted("{}: {}", name_of(kind), count));
  }
  std::string html = bullets(lines);
  html += rows.empty() ? ""
                       : html_table("Units with a failed test",
                                    {"serial", "first test", "last test", "meaning",
                                     "largest change / standard uncertainty", "reason"},
                                    rows);
  return html;
}

std::string outliers_section(const Fleet& fleet, const FleetUnits& units) {
  const std::vector<FleetOutlier> outliers = outliers_of(fleet, units);
  if (outliers.empty()) {
    return paragraph("No unit is outside the distribution of its batch.");
  }
  std::vector<std::vector<Cell>> rows;
  for (const FleetOutlier& one : outliers) {
    if (rows.size() == rows_of_page) {
      break;
    }
    rows.push_back({{one.test->serial, ""},
                    {named(one.test->batch), ""},
                    {fleet.parameters[one.parameter].name, ""},
                    number_cell(one.test->values[one.parameter], 6),
                    number_cell(one.z, 3),
                    {one.test->passed ? "passed" : "failed", ""}});
  }
  return html_table(
             formatted("{} coefficients are outside the distribution of their batch",
                       outliers.size()),
             {"serial", "batch", "coefficient", "value", "robust standard deviations", "last test"},
             rows) +
         paragraph(
             "The distribution is that of the batch itself: median and median absolute deviation. "
             "If all units are good, about one page in a hundred shows an outlier.");
}

void check(const Fleet& fleet) {
  if (fleet.tests.empty()) {
    throw DomainError("a fleet needs at least one test");
  }
  for (const FleetTest& test : fleet.tests) {
    for (const std::vector<double>* const list : {&test.values, &test.u, &test.u_noise}) {
      if (!list->empty() && list->size() != fleet.parameters.size()) {
        throw DomainError(formatted("unit '{}' has {} values; the fleet has {} parameters",
                                    test.serial, list->size(), fleet.parameters.size()));
      }
    }
  }
}

}  // namespace

std::string fleet_report(const Fleet& fleet) {
  check(fleet);
  const FleetUnits units = units_of(fleet);
  std::vector<Capability> capabilities;
  for (std::size_t k = 0; k < fleet.parameters.size(); ++k) {
    capabilities.push_back(capability_of(fleet, units, k));
  }
  Figures figures;
  struct Part {
    const char* id;
    const char* title;
    std::string content;
    Fold fold = Fold::never;
  };
  const std::vector<Part> parts = {
      {"yield", "Yield", yield_section(fleet, units)},
      {"pareto", "Reasons of failures", pareto_section(units, figures)},
      {"capability", "Capability", capability_section(fleet, capabilities)},
      {"retests", "Retests", retests_section(units)},
      {"outliers", "Outliers", outliers_section(fleet, units)},
      {"stations", "Stations",
       groups_section(fleet, units, capabilities, &FleetTest::station, "station", figures)},
      {"operators", "Operators",
       groups_section(fleet, units, capabilities, &FleetTest::operated_by, "operator", figures)},
      {"batches", "Batches",
       groups_section(fleet, units, capabilities, &FleetTest::batch, "batch", figures)},
      {"charts", "Control charts", figures.add_all(charts_by_time(fleet, units, capabilities)),
       Fold::open}};
  std::string links;
  std::string body;
  for (const Part& part : parts) {
    if (!part.content.empty()) {
      links += formatted("<li><a href=\"#{}\">{}</a></li>", part.id, part.title);
      body += section(part.id, part.title, part.content, part.fold);
    }
  }
  return html_page(
      {.title =
           formatted("Fleet of {}{}{}", fleet.kind, fleet.model.empty() ? "" : " ", fleet.model),
       .subtitle = formatted("{}, {}", fleet.source, output_timestamp()),
       .body = formatted("<nav aria-label=\"Contents\"><ul>{}</ul></nav>\n{}", links, body)});
}

}  // namespace axiscal
