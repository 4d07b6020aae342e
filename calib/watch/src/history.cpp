// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/history.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <utility>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/fitted_parameters.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/timestamp.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

constexpr double seconds_per_year = 365.2425 * 86400.0;

// A summary of a record. It is so small that a history can hold thousands of records.
struct Entry {
  std::string path;
  std::string failure;  // the reason why the text is not a record; empty for a record
  FittedParameters fitted;
  double time_s = 0.0;
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

// Sets the date at which the line value + slope x crosses a limit, where x is the time in years
// since the last record. The interval of this date ends where the 95 % band of the line crosses the
// limit (Fieller, J. R. Stat. Soc. B 16 (1954) 175).
void put_date_of_limit(const Eigen::Vector2d& line,
                       const Eigen::Matrix2d& covariance,
                       double degrees_of_freedom,
                       double last_year,
                       ParameterTrend& trend) {
  constexpr double longest_years = 100.0;  // longest extrapolation [years]
  if (line(1) == 0.0) {
    return;
  }
  const std::optional<double>& limit = line(1) > 0.0 ? trend.high : trend.low;
  if (!limit) {
    return;
  }
  const auto date_in = [&](double years) {
    return date_text((last_year + years) * seconds_per_year);
  };
  const double until = (*limit - line(0)) / line(1);
  if (!(until >= 0.0) || !(until < longest_years)) {
    return;
  }
  trend.meets_limit_on = date_in(until);
  const double t = student_t_factor(0.95, degrees_of_freedom);
  if (!std::isfinite(t) || !covariance.allFinite()) {
    return;
  }
  // The ends of the band cross the limit at the roots of a x^2 + b x + c = (limit - value - slope
  // x)^2 - t^2 var(value + slope x), where t is Student's factor.
  const double to_limit = *limit - line(0);
  const double a = line(1) * line(1) - t * t * covariance(1, 1);
  const double b = -2.0 * (to_limit * line(1) + t * t * covariance(0, 1));
  const double c = to_limit * to_limit - t * t * covariance(0, 0);
  if (c <= 0.0) {
    trend.meets_limit_from = date_in(0.0);  // the band already includes the limit
  }
  const double discriminant = b * b - 4.0 * a * c;
  if (!(discriminant >= 0.0)) {
    return;
  }
  const double root = std::sqrt(discriminant);
  const double first = (-b - root) / (2.0 * a);
  const double second = (-b + root) / (2.0 * a);
  for (const double meets : {std::min(first, second), std::max(first, second)}) {
    if (meets >= 0.0 && meets < longest_years && trend.meets_limit_from.empty()) {
      trend.meets_limit_from = date_in(meets);
    } else if (a > 0.0 && meets >= until && meets < longest_years) {
      trend.meets_limit_until = date_in(meets);  // only if the slope differs significantly from 0
    }
  }
}

// Fits a line to the values of a trend. The weights come from the uncertainties of the values if
// all of these are known. Otherwise the weights are equal.
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
  // The covariance is increased if the values scatter more than their uncertainties predict.
  const Eigen::MatrixXd covariance =
      known ? Eigen::MatrixXd(design.unscaled_covariance() *
                              (fit.residual_sd > 1.0 ? std::pow(fit.residual_sd, 2) : 1.0))
            : fit.covariance;
  trend.slope_u_per_year = std::sqrt(covariance(1, 1));
  if (n > 2) {
    trend.p_value = student_t_two_sided_p(trend.slope_per_year / trend.slope_u_per_year,
                                          static_cast<double>(n - 2));
  }
  put_date_of_limit(fit.estimate, covariance, known && n == 2 ? 1e6 : static_cast<double>(n - 2),
                    *last, trend);
}

UnitHistory history_of(const std::string& serial,
                       const std::vector<Entry>& entries,
                       const std::optional<Limits>& limits) {
  UnitHistory unit{.serial = serial};
  std::vector<double> years;
  for (const Entry& entry : entries) {
    unit.paths.push_back(entry.path);
    unit.dates.push_back(entry.fitted.date);
    years.push_back(entry.time_s / seconds_per_year);
  }
  Eigen::Index position = 0;
  for (const std::string& name : parameter_names(entries.back().fitted.axes)) {
    ParameterTrend trend{.parameter = name};
    for (const Entry& entry : entries) {
      trend.values.push_back(entry.fitted.values(position));
      trend.u.push_back(entry.fitted.u(position));
    }
    ++position;
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
  return unit;
}

// Returns the summary of a record, or the reason why the text is not a record.
Entry entry_of(const std::string& name, const std::string& text) {
  Entry entry{.path = name};
  try {
    entry.fitted = parse_fitted_parameters(text, name);
  } catch (const DataError& failure) {
    entry.failure = failure.what();
    return entry;
  }
  const std::optional<double> time = parse_date(entry.fitted.date);
  if (!time) {
    throw DataError(name, "/created",
                    "this text is not a date; the history needs the date of the calibration in "
                    "'measured' or 'created'");
  }
  entry.time_s = *time;
  return entry;
}

}  // namespace

RecordTexts records_in_folder(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".json") {
      paths.push_back(entry.path().string());
    }
  }
  if (error) {
    throw DataError(folder, "is not a folder that can be read");
  }
  std::sort(paths.begin(), paths.end());
  return {.names = paths, .text = [paths](std::size_t i) { return read_whole_file(paths[i]); }};
}

RecordTexts records_in_lines(const std::string& text, const std::string& name) {
  RecordTexts records;
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
    records.names.push_back(formatted("{}:{}", name, lines.size()));
  }
  records.text = [lines = std::move(lines)](std::size_t i) { return lines[i]; };
  return records;
}

std::vector<Calibration> read_records(const RecordTexts& records) {
  std::vector<Calibration> calibrations;
  for (std::size_t i = 0; i < records.names.size(); ++i) {
    try {
      calibrations.push_back(parse_calibration(records.text(i), records.names[i]));
    } catch (const DataError&) {
      continue;  // the text is not a record
    }
  }
  return calibrations;
}

std::vector<UnitHistory> read_history(const RecordTexts& records,
                                      const std::optional<Limits>& limits,
                                      std::vector<std::string>* passed_over,
                                      std::vector<std::string>* not_held) {
  std::vector<Entry> all(records.names.size());
  for_each_in_parallel(
      all.size(), [&](std::size_t i) { all[i] = entry_of(records.names[i], records.text(i)); });
  std::map<std::pair<std::string, std::vector<std::string>>, std::vector<Entry>> units;
  for (Entry& entry : all) {
    if (!entry.failure.empty()) {
      if (passed_over != nullptr) {
        passed_over->push_back(std::move(entry.failure));
      }
      continue;  // the text is not a record
    }
    units[{entry.fitted.serial, entry.fitted.axes}].push_back(std::move(entry));
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
    const bool may_be = std::any_of(units.begin(), units.end(), [&](const auto& unit) {
      return is_limit_parameter(limit.parameter, unit.first.second);
    });
    if (!known && may_be) {
      if (not_held != nullptr) {
        not_held->push_back(limit.parameter);
      }
    } else if (!known && !histories.empty()) {
      throw DomainError(formatted(
          "limit '{}': a history contains only biases and sensitivities, for example x.bias or "
          "x.sensitivity.y",
          limit.parameter));
    }
  }
  return histories;
}

std::string history_text(const UnitHistory& unit) {
  std::string text = formatted("{}: {} records from {} to {}\n",
                               unit.serial.empty() ? std::string("(no serial)") : unit.serial,
                               unit.paths.size(), unit.dates.front(), unit.dates.back());
  for (const ParameterTrend& trend : unit.trends) {
    text += formatted("  {}: {}", trend.parameter, number_text(trend.values.back(), 7));
    if (!std::isnan(trend.slope_per_year)) {
      text +=
          formatted(", change per year {} (standard uncertainty {})",
                    number_text(trend.slope_per_year, 2), number_text(trend.slope_u_per_year, 2));
    }
    if (trend.p_value < 0.05) {
      text += formatted(", significant trend (p = {})", number_text(trend.p_value, 2));
    }
    if (trend.outside) {
      text += ", outside its limits";
    } else if (!trend.meets_limit_on.empty()) {
      text += ", will reach its limit on " + trend.meets_limit_on;
      if (!trend.meets_limit_from.empty()) {
        text += formatted(
            " (95 % interval: from {} {})", trend.meets_limit_from,
            trend.meets_limit_until.empty() ? std::string("on") : "to " + trend.meets_limit_until);
      }
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
                {"dates", unit.dates},
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
        of["meets_limit_from"] =
            trend.meets_limit_from.empty() ? Json() : Json(trend.meets_limit_from);
        of["meets_limit_until"] =
            trend.meets_limit_until.empty() ? Json() : Json(trend.meets_limit_until);
      }
      one["trends"].push_back(std::move(of));
    }
    json.push_back(std::move(one));
  }
  return json_text(json);
}

}  // namespace axiscal
