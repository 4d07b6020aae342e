// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/wrapped_text.hpp"
#include "axiscal/logs/longest_rest.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/logs/noise_summary.hpp"
#include "axiscal/logs/segment.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/time_column.hpp"
#include "axiscal/report/noise_report.hpp"
#include "column_advice.hpp"
#include "core/formatted.hpp"
#include "log_input.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct NoiseCommand {
  std::string log;
  LogOptions options;
  std::optional<std::string> columns, tau, deviations, format, from, to;
  UnitOptions units;
  std::string output = "-";
  bool all = false;
  bool all_taus = false;
  bool is_curve = false;
  bool json = false;
};

void add_options(OptionSet& options, NoiseCommand& command) {
  options.add("log", command.log, "LOG", "log of any format (see `axiscal log`); - is stdin",
              Need::required);
  options.add("--columns", command.columns, "A,B,..",
              "columns of the sensors [default: all but the times]");
  add_log_options(options, command.options);
  options.add_flag("--all-taus", command.all_taus,
                   "compute the curve at ten averaging times per decade");
  options.add(
      "--from", command.from, "S",
      "start of the part at rest, in seconds after the first sample [default: the longest rest]");
  options.add("--to", command.to, "S",
              "end of the part at rest, in seconds after the first sample");
  add_unit_options(options, command.units);
  options.add("--tau", command.tau, "LO,HI",
              "fit the curve only between these averaging times [s]");
  options.add_flag("--curve", command.is_curve,
                   "LOG contains an Allan deviation curve instead of samples: a column tau, "
                   "columns of deviations (adev or other names), and optionally n, the number of "
                   "terms averaged at each point");
  options.add("--deviations", command.deviations, "mdev,hdev,totdev",
              "also compute the modified, Hadamard or total deviation");
  options.add("-o,--output", command.output, "FILE",
              "output file; - is stdout. FILE.html is a page with plots [default: -]");
  options.add_flag("--all", command.all, "print all coefficients and the curves");
  options.add_flag("--json", command.json, "print JSON instead of a table");
  options.add("--format", command.format, "kalibr",
              "write Kalibr's imu.yaml: noise densities, random walks and sampling rate of an IMU");
}

void warn(LogNoise& noise, const std::string& message) {
  noise.warnings.push_back(message);
  print_remark("warning", message);
}

// Replaces each missing number by the value before it, because the Allan deviation needs evenly
// spaced samples.
void fill_missing(const std::string& name, std::vector<double>& samples, LogNoise& noise) {
  std::size_t missing = 0;
  double last = 0.0;
  for (const double value : samples) {
    if (std::isfinite(value)) {
      last = value;
      break;
    }
  }
  for (double& value : samples) {
    if (!std::isfinite(value)) {
      value = last;
      ++missing;
    }
    last = value;
  }
  if (missing > 0) {
    warn(noise,
         formatted(
             "column '{}': {} cells are not numbers; each of them is replaced by the value in the "
             "row before",
             name, missing));
  }
}

// Returns the mean time step [s]. Gaps are not counted; if there are too many gaps, the result is
// nullopt.
// @param seconds  duration of one time unit [s].
std::optional<double> usual_step(const std::vector<double>& times, double seconds) {
  std::vector<double> steps(times.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    steps[i] = (times[i + 1] - times[i]) * seconds;
  }
  const double median = upper_median(steps);
  constexpr double gap = 5.0;  // a step longer than this number of median steps is a gap
  constexpr double most_gaps = 0.01;
  double sum = 0.0;
  double count = 0.0;
  for (const double step : steps) {
    if (step <= gap * median) {
      sum += step;
      count += 1.0;
    }
  }
  const bool are_few = count > (1.0 - most_gaps) * static_cast<double>(steps.size());
  return median > 0.0 && are_few ? std::optional(sum / count) : std::nullopt;
}

// Returns the sample rate [Hz] from --rate, or without that option from the column of times. Adds a
// warning if the samples are not evenly spaced.
double rate_of(const RecordedLog& log,
               const LogOptions& options,
               const std::optional<TimeColumn>& time,
               LogNoise& noise) {
  if (options.rate) {
    return parse_positive("--rate", *options.rate);
  }
  if (!time) {
    throw DataError(log.name,
                    "no column of times was recognised; name the column with --time COLUMN, or "
                    "give --rate HZ");
  }
  const std::vector<double>& times = log.samples[time->position];
  const TimeUnit unit = settle_time_unit(log.name, *time, times);
  if (!unit.remark.empty()) {
    warn(noise, unit.remark);
  }
  const double duration = (times.back() - times.front()) * unit.seconds;
  const double mean_step = duration / static_cast<double>(times.size() - 1);
  if (!(mean_step > 0.0)) {
    throw DataError(log.name, "the times do not increase; give --rate HZ instead");
  }
  std::size_t gaps = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double step = (times[i] - times[i - 1]) * unit.seconds;
    gaps += step > 5.0 * mean_step || step < 0.0 ? 1U : 0U;
  }
  if (gaps > 0) {
    warn(noise,
         formatted(
             "the times have {} gaps or backward steps; the samples are nevertheless treated as "
             "evenly spaced",
             gaps));
  }
  return 1.0 / usual_step(times, unit.seconds).value_or(mean_step);
}

// Returns the text that states whether the noise model (five kinds of noise) describes the curve.
std::string fit_text(const NoiseModel& model) {
  std::string text = formatted("  fit of the curve from {:.3g} s on: ", model.from_tau_s);
  if (std::isnan(model.p_value)) {
    return text + "too few points to test whether these kinds of noise describe the curve\n";
  }
  text += model.model_error > 0.0
              ? formatted(
                    "these kinds of noise do not describe the curve (p = {:.2g}); the curve "
                    "differs from the fit by {:.0f} %, and the intervals include this difference\n",
                    model.p_value, 100.0 * model.model_error)
              : formatted("these kinds of noise describe the curve (p = {:.2g})\n", model.p_value);
  if (model.white_by_stretch) {
    text +=
        "  the white noise is taken from the longest part of the curve with the slope of white "
        "noise,\n  because the fit of all kinds of noise gave a smaller value\n";
  }
  return text;
}

// Returns the results for a column: all coefficients, then the Allan deviations.
std::string listing_of(const ColumnNoise& one) {
  std::string text = formatted(
      "\n{}{}; coefficients with 95 % intervals, deviations with 68 % intervals\n", one.name,
      one.kind.empty() ? ""
                       : formatted(" ({}{})", one.kind, one.unit.empty() ? "" : ", " + one.unit));
  const std::string unit = one.unit.empty() ? "unit" : one.unit;
  for (const NoiseCoefficient& c : one.model.coefficients) {
    text += c.value > 0.0
                ? formatted("  {:<17}{:>12.5g}  ({:.4g} to {:.4g}) {}\n", noise_name(c.kind),
                            c.value, c.low, c.high, noise_unit(c.kind, unit))
            : std::isfinite(c.high)
                ? formatted("  {:<17}{:>15}  (below {:.2g} {})\n", noise_name(c.kind),
                            "not determined", c.high, noise_unit(c.kind, unit))
                : formatted("  {:<17}{:>15}\n", noise_name(c.kind), "not determined");
  }
  text += fit_text(one.model);
  text += formatted("  deviation at 1 s: {:.5g}\n", deviation_at(one.curve, 1.0));
  text += formatted("  dwell time {:.3g} s at a design point: Allan deviation {:.4g}; {}\n",
                    one.dwell.sensible_s, one.dwell.sensible_deviation,
                    one.dwell.beyond_record
                        ? "a longer dwell may be better, but the log is too short to show this"
                        : formatted("the smallest deviation is {:.4g}, at {:.3g} "
                                    "s",
                                    one.dwell.deviation, one.dwell.best_s));
  text += formatted("  {:>11}{:>14}{:>14}{:>14}", "tau [s]", "deviation", "low", "high");
  for (const auto& [which, deviations] : one.others) {
    text += formatted("{:>14}", name_of(which));
  }
  text += '\n';
  for (std::size_t i = 0; i < one.curve.size(); ++i) {
    const AllanPoint& point = one.curve[i];
    text += formatted("  {:>11.5g}{:>14.5g}{:>14.5g}{:>14.5g}", point.tau_s, point.deviation,
                      point.low, point.high);
    for (const auto& [which, deviations] : one.others) {
      text += std::isfinite(deviations[i]) ? formatted("{:>14.5g}", deviations[i])
                                           : formatted("{:>14}", "");
    }
    text += '\n';
  }
  return text;
}

std::string noise_text(const LogNoise& noise, bool all) {
  std::string text =
      noise.samples > 0
          ? formatted("{} samples at {:.6g} Hz, {:.6g} s", noise.samples, noise.rate_hz,
                      static_cast<double>(noise.samples) / noise.rate_hz)
          : std::string(
                "a curve from a log of unknown length; if the curve has no column n, the intervals "
                "assume that the log is twice as long as the longest tau");
  text += formatted("; 95 % intervals in brackets\n\n{}\n", noise_summary(noise));
  double shortest = noise.columns.front().dwell.sensible_s;
  double longest = shortest;
  for (const ColumnNoise& one : noise.columns) {
    shortest = std::min(shortest, one.dwell.sensible_s);
    longest = std::max(longest, one.dwell.sensible_s);
    if (!all && one.model.model_error > 0.0) {
      text += wrapped(formatted("{}: {}", one.name, trimmed(fit_text(one.model))), 80);
    }
  }
  text += shortest < longest ? formatted("Best dwell time at a design point: {:.3g} to {:.3g} s.\n",
                                         shortest, longest)
                             : formatted("Best dwell time at a design point: {:.3g} s.\n", longest);
  if (!all) {
    return text +
           "--all prints all coefficients and the curves; -o noise.html writes a page with plots\n";
  }
  for (const ColumnNoise& one : noise.columns) {
    text += listing_of(one);
  }
  return text;
}

// Returns the points of the curve in the range of --tau, or all points without this option.
std::vector<AllanPoint> fitted_part(const std::vector<AllanPoint>& curve,
                                    const NoiseCommand& command) {
  if (!command.tau) {
    return curve;
  }
  const ReadingRange range = range_of("--tau", *command.tau);
  std::vector<AllanPoint> part;
  std::copy_if(curve.begin(), curve.end(), std::back_inserter(part), [&](const AllanPoint& point) {
    return point.tau_s >= range.low && point.tau_s <= range.high;
  });
  if (part.size() < 3) {
    throw UsageError(
        formatted("--tau {}: only {} points of the curve lie in this range (the curve covers {} to "
                  "{} s); three or more are required",
                  *command.tau, part.size(), number_text(curve.front().tau_s, 3),
                  number_text(curve.back().tau_s, 3)));
  }
  return part;
}

void add_column(ColumnNoise one, const NoiseCommand& command, LogNoise& noise) {
  if (std::all_of(one.curve.begin(), one.curve.end(),
                  [](const AllanPoint& point) { return point.deviation <= 0.0; })) {
    warn(noise, formatted("column '{}' does not vary, so its noise cannot be estimated", one.name));
    return;
  }
  const std::vector<AllanPoint> part = fitted_part(one.curve, command);
  one.model = fit_noise(part);
  one.dwell = best_dwell(one.curve);
  noise.columns.push_back(std::move(one));
}

// Returns the indices of the columns to analyse. Without --columns, these are all columns of the
// log except those in `taken`.
std::vector<std::size_t> other_columns(const RecordedLog& log,
                                       const NoiseCommand& command,
                                       const std::vector<std::string>& taken) {
  std::vector<std::size_t> columns;
  if (command.columns) {
    for (const std::string& name : names_of(*command.columns)) {
      const std::size_t at = need_column(log.name, log.columns, name);
      if (std::find(columns.begin(), columns.end(), at) == columns.end()) {
        columns.push_back(at);
      }
    }
    return columns;
  }
  for (std::size_t at = 0; at < log.columns.size(); ++at) {
    if (std::find(taken.begin(), taken.end(), log.columns[at]) == taken.end()) {
      columns.push_back(at);
    }
  }
  return columns;
}

// The time step and the number of samples of the log from which a curve of Allan deviations was
// computed.
struct CurveSize {
  double step_s = 0.0;
  double samples = 0.0;
};

// Returns time step and number of samples of the log from which a curve was computed. The deviation
// at tau is a mean of N - 2 tau / step + 1 terms, with N the number of samples. N and step are
// therefore computed from the numbers of terms at the first and the last point. If the numbers of
// terms are not stated, one time step is assumed to be the shortest tau, and the log is assumed to
// be twice as long as the longest tau.
CurveSize size_of_curve(const std::string& name,
                        const std::vector<double>& tau,
                        const std::vector<double>* terms) {
  CurveSize size{.step_s = tau.front(), .samples = 2.0 * tau.back() / tau.front()};
  if (terms == nullptr) {
    return size;
  }
  for (std::size_t i = 0; i < terms->size(); ++i) {
    if (!((*terms)[i] >= 1.0) || !((*terms)[i] < 1e15)) {
      throw DataError(name, formatted("point {} of the curve: n must be 1 or more", i + 1));
    }
  }
  const double fewer = terms->front() - terms->back();
  if (fewer > 0.0) {
    size.step_s = std::min(2.0 * (tau.back() - tau.front()) / fewer, tau.front());
  }
  size.samples = terms->front() + 2.0 * tau.front() / size.step_s - 1.0;
  return size;
}

LogNoise noise_of_curve(const RecordedLog& log, const NoiseCommand& command) {
  if (command.deviations || command.all_taus || command.options.rate) {
    throw UsageError("--curve: cannot be combined with --deviations, --all-taus or --rate");
  }
  const std::vector<double>& tau = log.samples[need_column(log.name, log.columns, "tau")];
  const auto found = std::find(log.columns.begin(), log.columns.end(), "n");
  for (std::size_t i = 0; i < tau.size(); ++i) {
    if (!(tau[i] > (i > 0 ? tau[i - 1] : 0.0)) || !std::isfinite(tau[i])) {
      throw DataError(log.name,
                      formatted("point {} of the curve: tau must be positive, and larger than at "
                                "the point before",
                                i + 1));
    }
  }
  const std::vector<double>* const terms =
      found != log.columns.end()
          ? &log.samples[static_cast<std::size_t>(found - log.columns.begin())]
          : nullptr;
  const CurveSize size = size_of_curve(log.name, tau, terms);
  std::vector<AllanPoint> points;
  for (std::size_t i = 0; i < tau.size(); ++i) {
    AllanPoint& point = points.emplace_back();
    point.tau_s = tau[i];
    point.samples = static_cast<std::size_t>(std::max(std::lround(tau[i] / size.step_s), 1L));
    point.terms = terms != nullptr ? static_cast<std::size_t>((*terms)[i]) : 0;
  }
  LogNoise noise{.rate_hz = 1.0 / size.step_s,
                 .samples = terms != nullptr ? static_cast<std::size_t>(size.samples) : 0};
  for (const std::size_t at : other_columns(log, command, {"tau", "n"})) {
    const std::string& column = log.columns[at];
    ColumnNoise one{.name = column, .curve = points};
    const std::vector<double>& values = log.samples[at];
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!(values[i] >= 0.0) || !std::isfinite(values[i])) {
        throw DataError(log.name, formatted("point {} of the curve, column '{}': a deviation must "
                                            "be a number, 0 or more",
                                            i + 1, column));
      }
      one.curve[i].deviation = values[i];
    }
    add_intervals(one.curve, size.samples + 1.0);
    add_column(std::move(one), command, noise);
  }
  return noise;
}

std::vector<OtherDeviation> deviations_of(const NoiseCommand& command) {
  std::vector<OtherDeviation> all;
  for (const std::string& name :
       command.deviations ? names_of(*command.deviations) : std::vector<std::string>{}) {
    const std::optional<OtherDeviation> which = other_deviation_of(name);
    if (!which && name != "adev") {
      throw UsageError(formatted("--deviations: '{}' must be mdev, hdev or totdev", name));
    }
    if (which) {
      all.push_back(*which);
    }
  }
  return all;
}

// Returns the unit in which the median magnitude of an accelerometer's readings is that of gravity.
// The result is empty if there is no such unit, or if the sensor is not an accelerometer.
std::string unit_by_gravity(const RecordedLog& log, const LogSensor& sensor) {
  std::vector<double> squares;
  for (const std::string& name : sensor.columns) {
    const std::optional<std::size_t> column = find_column(log.columns, name);
    if (!column || sensor.kind != SeriesKind::accelerometer) {
      return "";
    }
    const std::vector<double>& samples = log.samples[*column];
    squares.resize(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      squares[i] += samples[i] * samples[i];
    }
  }
  std::erase_if(squares, [](double square) { return !std::isfinite(square); });
  if (squares.empty()) {
    return "";
  }
  const double length = std::sqrt(upper_median(std::move(squares)));
  constexpr double tolerance = 0.2;
  for (const auto& [unit, gravity] : {std::pair("m/s^2", 9.80665), {"g", 1.0}, {"mg", 1000.0}}) {
    if (std::abs(length - gravity) < tolerance * gravity) {
      return unit;
    }
  }
  return "";
}

// Returns the columns that are used to find rests: those of accelerometer and gyroscope. If the log
// has neither sensor, returns the analysed columns except temperatures.
std::vector<RestColumn> rest_columns(const RecordedLog& log,
                                     const std::vector<LogSensor>& sensors,
                                     const std::vector<std::size_t>& analysed) {
  std::vector<RestColumn> columns;
  for (const LogSensor& sensor : sensors) {
    if (sensor.kind != SeriesKind::accelerometer && sensor.kind != SeriesKind::gyroscope) {
      continue;
    }
    const std::optional<KnownUnit> unit =
        known_unit(sensor.unit.empty() ? unit_by_gravity(log, sensor) : sensor.unit, sensor.kind);
    for (const std::string& name : sensor.columns) {
      if (const std::optional<std::size_t> column = find_column(log.columns, name)) {
        columns.push_back({.samples = log.samples[*column],
                           .kind = sensor.kind,
                           .si = unit && unit->kind == sensor.kind ? unit->si : 0.0});
      }
    }
  }
  if (!columns.empty()) {
    return columns;
  }
  for (const std::size_t column : analysed) {
    if (sensor_kind_in(log.columns[column]) != SeriesKind::temperature) {
      columns.push_back({.samples = log.samples[column]});
    }
  }
  return columns;
}

// Cuts a log to the part from --from to --to. If neither is stated, cuts it to its longest rest.
void cut_to_rest(RecordedLog& log,
                 const std::vector<LogSensor>& sensors,
                 const std::vector<std::size_t>& analysed,
                 const NoiseCommand& command,
                 LogNoise& noise) {
  const std::size_t n = log.samples.front().size();
  const auto sample_at = [&](const char* option, const std::optional<std::string>& text,
                             std::size_t otherwise) {
    if (!text) {
      return otherwise;
    }
    const double at = std::round(parse_nonnegative(option, *text) * noise.rate_hz);
    return static_cast<std::size_t>(std::min(at, static_cast<double>(n)));
  };
  LongestRest part{.first = sample_at("--from", command.from, 0),
                   .end = sample_at("--to", command.to, n)};
  if (part.end <= part.first) {
    throw UsageError("--from, --to: the log contains no samples in this interval");
  }
  if (!command.from && !command.to) {
    const std::vector<RestColumn> columns = rest_columns(log, sensors, analysed);
    part = columns.empty() ? part : longest_rest(columns, noise.rate_hz);
    const auto seconds = [&](std::size_t sample) {
      return number_text(static_cast<double>(sample) / noise.rate_hz, 4);
    };
    if (part.moves) {
      throw RefusedError(
          formatted("{}: the instrument moves all the time; the longest quiet part of the log is "
                    "from {} to {} s. Record a log at rest, or select a part at rest with --from "
                    "and --to",
                    log.name, seconds(part.first), seconds(part.end)));
    }
    if (part.first > 0 || part.end < n) {
      warn(noise,
           formatted("the instrument is not at rest all the time: the noise is computed from the "
                     "longest rest, which lasts from {} to {} s, and {} % of the samples are left "
                     "out (--from and --to select another part)",
                     seconds(part.first), seconds(part.end),
                     number_text(100.0 * static_cast<double>(n - (part.end - part.first)) /
                                     static_cast<double>(n),
                                 2)));
    }
  }
  for (std::vector<double>& column : log.samples) {
    column.assign(column.begin() + static_cast<std::ptrdiff_t>(part.first),
                  column.begin() + static_cast<std::ptrdiff_t>(part.end));
  }
  noise.samples = part.end - part.first;
}

LogNoise noise_of_log(LogInput& input, const NoiseCommand& command) {
  RecordedLog& log = input.log;
  constexpr std::size_t fewest = 9;
  const auto require_enough = [&](std::size_t count) {
    if (count < fewest) {
      throw RefusedError(formatted("{} samples are too few for an Allan deviation", count));
    }
  };
  require_enough(log.samples.front().size());
  const std::optional<TimeColumn> time =
      find_time_column(log.name, log.columns, command.options.table.time.value_or(""));
  LogNoise noise{.samples = log.samples.front().size()};
  noise.rate_hz = rate_of(log, command.options, time, noise);
  const std::vector<std::string> of_time =
      time ? std::vector{log.columns[time->position]} : std::vector<std::string>{};
  cut_to_rest(log, input.sensors, other_columns(log, command, of_time), command, noise);
  const std::size_t n = noise.samples;
  require_enough(n);
  const std::vector<OtherDeviation> others = deviations_of(command);
  const std::vector<std::size_t> lengths = command.all_taus ? decade_lengths(n) : octave_lengths(n);
  for (const std::size_t at : other_columns(log, command, of_time)) {
    const std::string& column = log.columns[at];
    std::vector<double>& samples = log.samples[at];
    fill_missing(column, samples, noise);
    ColumnNoise one{.name = column, .curve = {}};
    for (const OtherDeviation which : others) {
      one.others[which] = other_deviations(which, samples, noise.rate_hz, lengths);
    }
    one.curve = allan_deviation_in_place(samples, noise.rate_hz, lengths);
    add_column(std::move(one), command, noise);
  }
  return noise;
}

// Sets the kind, unit and sampling rate of the sensor of each column.
void name_sensors(const std::vector<LogSensor>& sensors,
                  const UnitOptions& units,
                  LogNoise& noise) {
  for (ColumnNoise& one : noise.columns) {
    one.rate_hz = noise.rate_hz;
    for (const LogSensor& sensor : sensors) {
      if (std::find(sensor.columns.begin(), sensor.columns.end(), one.name) !=
          sensor.columns.end()) {
        one.kind = name_of(sensor.kind);
        one.unit = sensor.unit;
      }
    }
    const std::optional<std::string>& stated =
        one.kind == name_of(SeriesKind::accelerometer)  ? units.accelerometer
        : one.kind == name_of(SeriesKind::gyroscope)    ? units.gyroscope
        : one.kind == name_of(SeriesKind::magnetometer) ? units.magnetometer
                                                        : units.all;
    const std::optional<std::string>& unit = stated ? stated : units.all;
    if (one.unit.empty() && unit) {
      const std::optional<KnownUnit> known = known_unit(*unit);
      one.unit = known ? std::string(known->name) : *unit;
      one.kind = one.kind.empty() && known ? std::string(name_of(known->kind)) : one.kind;
    }
  }
}

LogNoise noise_of_input(LogInput& input, const NoiseCommand& command) {
  if (!command.is_curve && !command.options.rate && !command.options.table.time) {
    NoiseCommand own = command;
    if (!input.time.empty()) {
      own.options.table.time = input.time;
    } else if (input.stated_rate_hz) {
      own.options.rate = number_text(*input.stated_rate_hz);
    }
    return noise_of_log(input, own);
  }
  if (command.is_curve && (command.from || command.to)) {
    throw UsageError("--from, --to: cannot be combined with --curve");
  }
  return command.is_curve ? noise_of_curve(input.log, command) : noise_of_log(input, command);
}

// Analyses the sensors of a recording separately, because each sensor has its own times.
LogNoise noise_of_sensors(const NoiseCommand& command,
                          LogFormat format,
                          const std::vector<LogSensor>& sensors) {
  LogNoise all;
  for (const LogSensor& sensor : sensors) {
    format.kinds = {sensor.kind};
    print_remark("note", sensor.words);
    LogInput input = record_log(command.log, format);
    NoiseCommand own = command;
    own.columns = joined({sensor.columns.begin(), sensor.columns.end()}, ",");
    LogNoise one = noise_of_input(input, own);
    name_sensors({sensor}, command.units, one);
    if (all.columns.empty()) {
      all.rate_hz = one.rate_hz;
      all.samples = one.samples;
    }
    std::move(one.columns.begin(), one.columns.end(), std::back_inserter(all.columns));
    all.warnings.insert(all.warnings.end(), one.warnings.begin(), one.warnings.end());
  }
  return all;
}

int run(const NoiseCommand& command) {
  if (command.format && *command.format != "kalibr") {
    throw UsageError(formatted("--format: '{}' must be 'kalibr'", *command.format));
  }
  const std::vector<std::string> wanted =
      command.columns ? names_of(*command.columns) : std::vector<std::string>{};
  const LogFormat format = format_of(command.options, wanted);
  LogFile file(command.log, format);
  LogNoise noise;
  if (!file.is_table() && !command.columns && can_be_read_again(command.log)) {
    noise = noise_of_sensors(command, format, file.sensors());
  } else {
    LogInput input = record_log(std::move(file));
    for (const std::string& note : input.log.notes) {
      print_remark("note", note);
    }
    noise = with_column_advice("--columns", "", [&] { return noise_of_input(input, command); });
    name_sensors(input.sensors, command.units, noise);
  }
  if (noise.columns.empty()) {
    throw RefusedError("all columns are constant");
  }
  const bool page = command.output.ends_with(".html") || command.output.ends_with(".htm");
  write_text(command.output, command.format ? kalibr_imu_yaml(noise)
                             : command.json || command.output.ends_with(".json") ? noise_json(noise)
                             : page ? noise_report(noise, command.log)
                                    : noise_text(noise, command.all || command.deviations));
  return 0;
}

}  // namespace

Subcommand noise_subcommand() {
  return make_subcommand<NoiseCommand>("noise",
                                       "compute the Allan deviation and the noise of a log at rest",
                                       "", &add_options, &run);
}

}  // namespace axiscal::cli
