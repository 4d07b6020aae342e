// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/history.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"

namespace axiscal {
namespace {

constexpr double seconds_per_year = 365.2425 * 86400.0;

struct Entry {
  std::string path;
  double time_s = 0.0;
  Calibration calibration;
};

std::string date_text(double seconds) {
  const auto day = std::chrono::floor<std::chrono::days>(
      std::chrono::sys_seconds(std::chrono::seconds(static_cast<std::int64_t>(seconds))));
  const std::chrono::year_month_day date(day);
  const auto two = [](unsigned number) {
    return (number < 10 ? "0" : "") + std::to_string(number);
  };
  return formatted("{}-{}-{}", static_cast<int>(date.year()),
                   two(static_cast<unsigned>(date.month())),
                   two(static_cast<unsigned>(date.day())));
}

// A line through the values; where their uncertainties are known by these, else by the scatter.
void put_trend(const std::vector<double>& years, ParameterTrend& trend) {
  const auto n = static_cast<Eigen::Index>(years.size());
  trend.slope_per_year = not_a_number;
  trend.slope_u_per_year = not_a_number;
  trend.p_value = not_a_number;
  const auto [first, last] = std::minmax_element(years.begin(), years.end());
  if (n < 2 || !(*last > *first)) {
    return;
  }
  Eigen::MatrixXd X(n, 2);
  Eigen::VectorXd y(n);
  Eigen::VectorXd w = Eigen::VectorXd::Ones(n);
  bool known = true;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    X.row(i) << 1.0, years[at] - *last;
    y(i) = trend.values[at];
    known = known && trend.u[at] > 0.0;
  }
  for (Eigen::Index i = 0; i < n && known; ++i) {
    const double u = trend.u[static_cast<std::size_t>(i)];
    w(i) = 1.0 / (u * u);
  }
  const LeastSquaresDesign design(X, w);
  const LeastSquaresFit fit = design.fit(y);
  trend.slope_per_year = fit.estimate(1);
  double variance = known ? design.unscaled_covariance()(1, 1) : fit.covariance(1, 1);
  if (known && fit.residual_sd > 1.0) {
    variance *= fit.residual_sd * fit.residual_sd;  // the unit scatters more than is stated
  }
  trend.slope_u_per_year = std::sqrt(variance);
  if (n > 2) {
    trend.p_value = student_t_two_sided_p(trend.slope_per_year / trend.slope_u_per_year,
                                          static_cast<double>(n - 2));
  }
  // When the line, as it stands at the last record, meets a limit.
  const double now = fit.estimate(0);
  const auto years_until = [&](const std::optional<double>& limit) -> std::optional<double> {
    if (!limit || trend.slope_per_year == 0.0) {
      return std::nullopt;
    }
    const double until = (*limit - now) / trend.slope_per_year;
    return until >= 0.0 ? std::optional(until) : std::nullopt;
  };
  std::optional<double> until;
  for (const std::optional<double>& limit : {trend.low, trend.high}) {
    if (const auto one = years_until(limit); one && (!until || *one < *until)) {
      until = one;
    }
  }
  constexpr double longest_years = 100.0;  // no line holds longer
  if (until && *until < longest_years) {
    trend.meets_limit_on = date_text((*last + *until) * seconds_per_year);
  }
}

UnitHistory history_of(const std::string& serial,
                       const std::vector<Entry>& entries,
                       const std::optional<Limits>& limits) {
  UnitHistory unit{.serial = serial};
  std::vector<double> years;
  for (const Entry& entry : entries) {
    unit.paths.push_back(entry.path);
    unit.created.push_back(entry.calibration.created);
    years.push_back(entry.time_s / seconds_per_year);
  }
  for (const std::string& axis : entries.back().calibration.instrument.axes) {
    for (const std::string& name : parameter_names({axis})) {
      ParameterTrend trend{.parameter = name};
      for (const Entry& entry : entries) {
        const Calibration& calibration = entry.calibration;
        trend.values.push_back(parameter_value(calibration, trend.parameter));
        const Eigen::MatrixXd covariance = parameter_covariance(calibration);
        const auto at = calibration.statistics
                            ? calibration.statistics->position_of(trend.parameter)
                            : std::nullopt;
        trend.u.push_back(at && covariance.rows() > *at ? std::sqrt(covariance(*at, *at))
                                                        : not_a_number);
      }
      for (const Limit& limit : limits ? limits->limits : std::vector<Limit>{}) {
        if (limit.parameter == trend.parameter) {
          trend.low = limit.low;
          trend.high = limit.high;
        }
      }
      const double newest = trend.values.back();
      trend.outside = (trend.low && newest < *trend.low) || (trend.high && newest > *trend.high);
      put_trend(years, trend);
      unit.trends.push_back(std::move(trend));
    }
  }
  return unit;
}

}  // namespace

std::vector<UnitHistory> read_history(const std::string& folder,
                                      const std::optional<Limits>& limits,
                                      std::vector<std::string>* passed_over) {
  std::error_code error;
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".json") {
      paths.push_back(entry.path().string());
    }
  }
  if (error) {
    throw DataError(folder, "is no folder that can be read");
  }
  std::sort(paths.begin(), paths.end());
  std::map<std::pair<std::string, std::string>, std::vector<Entry>> units;
  for (const std::string& path : paths) {
    Entry entry{.path = path};
    try {
      entry.calibration = read_calibration(path);
    } catch (const DataError& failure) {
      if (passed_over != nullptr) {
        passed_over->emplace_back(failure.what());
      }
      continue;  // another kind of file
    }
    const std::optional<double> time = parse_timestamp(entry.calibration.created);
    if (!time) {
      throw DataError(path, "/created", "the history needs the date at which a record was made");
    }
    entry.time_s = *time;
    const Instrument& instrument = entry.calibration.instrument;
    units[{instrument.serial, joined(instrument.axes)}].push_back(std::move(entry));
  }
  std::vector<UnitHistory> histories;
  for (auto& [key, entries] : units) {
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return a.time_s < b.time_s; });
    histories.push_back(history_of(key.first, entries, limits));
  }
  for (const Limit& limit : limits ? limits->limits : std::vector<Limit>{}) {
    const bool known =
        std::any_of(histories.begin(), histories.end(), [&](const UnitHistory& unit) {
          return std::any_of(
              unit.trends.begin(), unit.trends.end(),
              [&](const ParameterTrend& trend) { return trend.parameter == limit.parameter; });
        });
    if (!known && !histories.empty()) {
      throw DomainError(formatted(
          "limit '{}': a history knows biases and sensitivities only, as x.bias or x.sensitivity.y",
          limit.parameter));
    }
  }
  return histories;
}

std::string history_text(const UnitHistory& unit) {
  std::string text = formatted("{}: {} records from {} to {}\n",
                               unit.serial.empty() ? std::string("(no serial)") : unit.serial,
                               unit.paths.size(), unit.created.front(), unit.created.back());
  for (const ParameterTrend& trend : unit.trends) {
    text += formatted("  {}: {}", trend.parameter, number_text(trend.values.back(), 7));
    if (!std::isnan(trend.slope_per_year)) {
      text += formatted(", {} a year (u {})", number_text(trend.slope_per_year, 2),
                        number_text(trend.slope_u_per_year, 2));
    }
    if (trend.p_value < 0.05) {
      text += formatted(", a trend (p = {})", number_text(trend.p_value, 2));
    }
    if (trend.outside) {
      text += ", outside its limits";
    } else if (!trend.meets_limit_on.empty()) {
      text += ", meets its limit on " + trend.meets_limit_on;
    }
    text += "\n";
  }
  return text;
}

std::string history_json(const std::vector<UnitHistory>& units) {
  Json json = Json::array();
  for (const UnitHistory& unit : units) {
    Json one = {{"serial", unit.serial},
                {"records", unit.paths},
                {"created", unit.created},
                {"trends", Json::array()}};
    for (const ParameterTrend& trend : unit.trends) {
      Json of = {{"parameter", trend.parameter},
                 {"values", trend.values},
                 {"u", trend.u},
                 {"slope_per_year", trend.slope_per_year},
                 {"slope_u_per_year", trend.slope_u_per_year},
                 {"p_value", trend.p_value}};
      of["outside"] = trend.outside;
      if (!trend.meets_limit_on.empty()) {
        of["meets_limit_on"] = trend.meets_limit_on;
      }
      one["trends"].push_back(std::move(of));
    }
    json.push_back(std::move(one));
  }
  return json_text(json);
}

}  // namespace axiscal
