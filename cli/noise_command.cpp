// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/logs/segment.hpp"
#include "log_input.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct NoiseCommand {
  std::string log;
  LogOptions options;
  std::optional<std::string> columns;
  std::string output = "-";
  bool all_taus = false;
  bool json = false;
};

void add_options(OptionSet& options, NoiseCommand& command) {
  options.add("log", command.log, "LOG", "text, .npy, .mat, also .gz .xz .zst; - is stdin",
              Need::required);
  options.add("--columns", command.columns, "A,B,..", "columns; all but the times");
  add_log_options(options, command.options);
  options.add_flag("--all-taus", command.all_taus, "the curve at ten averaging times a decade");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

void warn(LogNoise& noise, const std::string& message) {
  noise.warnings.push_back(message);
  print_remark("warning", message);
}

// Missing numbers take the value before them; the Allan deviation needs even spacing.
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
    warn(noise, formatted("column '{}': {} cells are no numbers; each counts as the one before it",
                          name, missing));
  }
}

// The rate of the times, and warnings where they are not even.
double rate_of(const RecordedLog& log,
               const LogOptions& options,
               const std::optional<TimeColumn>& time,
               LogNoise& noise) {
  if (options.rate) {
    return positive_of("--rate", *options.rate);
  }
  if (!time) {
    throw DataError(log.name,
                    "has no column of times; name it with --time COLUMN, or give --rate HZ");
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
    warn(noise, formatted("{} gaps or steps back in the times: the samples are taken as evenly "
                          "spaced all the same",
                          gaps));
  }
  return 1.0 / mean_step;
}

std::string noise_text(const LogNoise& noise) {
  std::string text = formatted(
      "{} samples at {:.6g} Hz, {:.6g} s; coefficients with 95 % intervals, "
      "deviations with 68 %\n",
      noise.samples, noise.rate_hz, static_cast<double>(noise.samples) / noise.rate_hz);
  for (const ColumnNoise& one : noise.columns) {
    text += formatted("\n{}\n", one.name);
    for (const NoiseCoefficient& c : one.model.coefficients) {
      text += c.value > 0.0
                  ? formatted("  {:<17}{:>12.5g}  ({:.4g} to {:.4g}) {}\n", noise_name(c.kind),
                              c.value, c.low, c.high, noise_unit(c.kind))
              : std::isfinite(c.high)
                  ? formatted("  {:<17}{:>12}  (below {:.2g} {})\n", noise_name(c.kind), "not seen",
                              c.high, noise_unit(c.kind))
                  : formatted("  {:<17}{:>12}\n", noise_name(c.kind), "not determined");
    }
    text += formatted("  dwell {:.3g} s a design point: {:.4g} of a mean; {}\n",
                      one.dwell.sensible_s, one.dwell.sensible_deviation,
                      one.dwell.beyond_record
                          ? "longer may be better still, the record is too short to tell"
                          : formatted("no better than {:.4g}, at {:.3g} s", one.dwell.deviation,
                                      one.dwell.best_s));
    text += formatted("  {:>11}{:>14}{:>14}{:>14}\n", "tau [s]", "deviation", "low", "high");
    for (const AllanPoint& point : one.curve) {
      text += formatted("  {:>11.5g}{:>14.5g}{:>14.5g}{:>14.5g}\n", point.tau_s, point.deviation,
                        point.low, point.high);
    }
  }
  return text;
}

int run(const NoiseCommand& command) {
  RecordedLog log = record_log(command.log, command.options);
  for (const std::string& note : log.notes) {
    print_remark("note", note);
  }
  const std::size_t n = log.samples.front().size();
  if (n < 9) {
    throw RefusedError(formatted("{} samples are too few for an Allan deviation", n));
  }
  const std::optional<TimeColumn> time =
      find_time_column(log.name, log.columns, command.options.time.value_or(""));
  LogNoise noise{.samples = n};
  const double rate_hz = rate_of(log, command.options, time, noise);
  noise.rate_hz = rate_hz;
  std::vector<std::string> columns;
  if (command.columns) {
    columns = names_of(*command.columns);
  } else {
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      if (!time || time->position != c) {
        columns.push_back(log.columns[c]);
      }
    }
  }
  const std::vector<std::size_t> lengths = command.all_taus ? decade_lengths(n) : octave_lengths(n);
  for (const std::string& column : columns) {
    std::vector<double>& samples = log.samples[need_column(log.name, log.columns, column)];
    fill_missing(column, samples, noise);
    ColumnNoise one{.name = column, .curve = allan_deviation(samples, rate_hz, lengths)};
    if (std::all_of(one.curve.begin(), one.curve.end(),
                    [](const AllanPoint& point) { return point.deviation <= 0.0; })) {
      warn(noise, formatted("column '{}' does not vary; it has no noise to speak of", column));
      continue;
    }
    one.model = fit_noise(one.curve);
    one.dwell = best_dwell(one.model, one.curve.back().tau_s);
    noise.columns.push_back(std::move(one));
  }
  if (noise.columns.empty()) {
    throw RefusedError("no column varies");
  }
  write_whole_file(command.output, command.json ? noise_json(noise) : noise_text(noise));
  return 0;
}

}  // namespace

Subcommand noise_subcommand() {
  return make_subcommand<NoiseCommand>(
      "noise", "log at rest -> Allan deviation, noise",
      "Example: axiscal noise rest.csv --columns gx,gy,gz --rate 100", &add_options, &run);
}

}  // namespace axiscal::cli
