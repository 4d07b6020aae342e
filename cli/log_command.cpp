// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>
#include <optional>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/logs/recorded_sensor.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "core/formatted.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "table_options.hpp"

namespace axiscal::cli {
namespace {

struct LogCommand {
  std::string log;
  std::string output = "-";
  std::optional<std::string> definitions, limits;
  bool json = false;
};

void add_options(OptionSet& options, LogCommand& command) {
  options.add("log", command.log, "FILE", "log of any format; - is stdin", Need::required);
  options.add_output(command.output);
  add_definitions_option(options, command.definitions);
  add_limit_option(options, command.limits);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

std::string full_name(const SeriesSummary& one) {
  return one.series.instance > 0 ? formatted("{}[{}]", one.series.name, one.series.instance)
                                 : one.series.name;
}

// Returns the names of the columns of a series. If the kind of the series is unknown, lists all
// columns, because the user needs their names for other commands.
std::string columns_text(const SeriesSummary& one) {
  constexpr std::size_t most = 4;
  std::vector<std::string> columns = one.series.columns;
  if (columns.size() > most && one.series.kind != SeriesKind::other) {
    const std::size_t more = columns.size() - most + 1;
    columns.resize(most - 1);
    columns.push_back(formatted("and {} more", more));
  }
  return joined(columns);
}

std::string series_table(const RecordingSummary& summary) {
  std::size_t width = 6;
  for (const SeriesSummary& one : summary.series) {
    width = std::max(width, full_name(one).size());
  }
  width = std::min<std::size_t>(width, 36);
  std::string text = formatted("{:<{}}  {:<13}  {:>9}  {:>9}  {:>10}  {:<7} {}\n", "series", width,
                               "kind", "samples", "rate [Hz]", "span [s]", "unit", "columns");
  for (const SeriesSummary& one : summary.series) {
    const bool has_times = std::isfinite(one.start_s) && std::isfinite(one.end_s);
    const std::size_t missing =
        std::accumulate(one.missing.begin(), one.missing.end(), std::size_t{0});
    text += formatted(
        "{:<{}}  {:<13}  {:>9}  {:>9}  {:>10}  {:<7} {}{}\n", full_name(one), width,
        name_of(one.series.kind), one.samples,
        std::isfinite(one.rate_hz) ? number_text(one.rate_hz, 4) : "-",
        has_times ? number_text(one.end_s - one.start_s, 5) : "-",
        one.series.unit.empty() ? "-" : one.series.unit, columns_text(one),
        std::string(one.gaps > 0 ? formatted("; gaps: {}", one.gaps) : "") +
            (missing > 0 ? formatted("; missing numbers: {}", missing) : "") +
            (one.series.kind != SeriesKind::other && is_constant(one) ? "; does not vary" : ""));
  }
  return text;
}

// Returns a file name, quoted for a shell if needed.
std::string quoted(const std::string& path) {
  const bool is_plain = path.find_first_of(" '\"()[]{}*?&;|<>$`\\!#~") == std::string::npos;
  return is_plain ? path : "'" + path + "'";
}

// Returns the line "next: .." with a command that the user can copy and run unchanged.
std::string next_of(const std::string& command) {
  return "next: axiscal " + command + "\n";
}

std::string columns_of(const RecordedSensor& sensor) {
  return quoted(joined({sensor.columns.begin(), sensor.columns.end()}, ","));
}

std::string next_for_turned(const RecordedSensor& sensor,
                            const std::string& kind,
                            const std::string& file) {
  return next_of(formatted("calibrate {} --instrument {} --method magnitude --axes {} -o {}.json",
                           file, kind, columns_of(sensor), kind));
}

bool has_times(const SeriesSummary& one) {
  return std::isfinite(one.end_s - one.start_s);
}

std::string next_for_accelerometer(const RecordingSummary& summary,
                                   const RecordedSensor& accelerometer,
                                   const std::vector<RecordedSensor>& sensors,
                                   const std::string& file) {
  const SeriesSummary& one = summary.series[accelerometer.series];
  const double still_s = one.still_to_s - one.still_from_s;
  const double span_s = one.end_s - one.start_s;
  // In a calibration log, the longest period at rest is at most this share of the log's duration.
  constexpr double most = 0.34;
  constexpr double shortest_s = 1.0;
  constexpr std::size_t most_readings = 500;
  if (!has_times(one) && one.samples <= most_readings) {
    return next_for_turned(accelerometer, "accelerometer", file);
  }
  const bool several = std::any_of(sensors.begin(), sensors.end(),
                                   [](const RecordedSensor& sensor) { return sensor.number > 0; });
  const std::string output = formatted("-o 'imu-{{slot}}{}.json'", several ? "-{instance}" : "");
  if (!has_times(one)) {
    return "the file contains no times; replace 100 in this command by the number of samples per "
           "second\n" +
           next_of(formatted("calibrate --imu {} --rate 100 {}", file, output));
  }
  if (still_s > most * span_s) {
    constexpr double nearly_all = 0.9;
    return std::string("the accelerometer is at rest ") +
           (still_s > nearly_all * span_s ? "all the time\n" : "most of the time\n") +
           next_of(formatted("noise {} -o noise.txt", file));
  }
  if (still_s < shortest_s) {
    return "the accelerometer is never at rest for a second or longer, so this log cannot be used "
           "to calibrate it.\nLog the accelerometer at rest for some seconds in each of 12 or more "
           "orientations, and run\n`calibrate --imu` on the new log\n";
  }
  return formatted("the accelerometer's longest rest is from {} to {} s after its first sample\n",
                   number_text(one.still_from_s, 4), number_text(one.still_to_s, 4)) +
         next_of(formatted("calibrate --imu {} {}", file, output));
}

// Returns the next command for a log in which no sensor is recognised. The command assumes that the
// first three columns with varying values in one series are the axes of a sensor.
std::string next_for_unknown(const RecordingSummary& summary, const std::string& file) {
  for (const SeriesSummary& one : summary.series) {
    std::vector<std::string> three;
    for (std::size_t c = 0; c < one.series.columns.size() && three.size() < 3; ++c) {
      const bool varies = c < one.sd.size() && one.sd[c] > 0.0;
      const bool can_be_typed = one.series.columns[c].find(',') == std::string::npos;
      if (varies && can_be_typed) {
        three.push_back(one.series.columns[c]);
      }
    }
    if (three.size() < 3) {
      continue;
    }
    const std::string columns = quoted(joined(three, ","));
    return formatted(
               "no accelerometer, gyroscope or magnetometer was recognised from the column "
               "names, units or values;\nif the columns {} are the axes of {}, use this command; "
               "otherwise, replace the\ncolumns in the command:\n",
               joined(three),
               has_times(one) ? "an accelerometer"
                              : "a magnetometer that was "
                                "turned by hand") +
           next_of(
               has_times(one)
                   ? formatted("calibrate --imu {} --accelerometer {} -o 'imu-{{slot}}.json'", file,
                               columns)
                   : formatted("calibrate {} --instrument magnetometer --method magnitude --axes "
                               "{} -o magnetometer.json",
                               file, columns));
  }
  return "no accelerometer, gyroscope or magnetometer was recognised from the column names, units "
         "or values\n";
}

// Returns the command that the user should run next, according to the content of the file.
// @param file  the name of the log, quoted for a shell, followed by the options for reading it.
std::string next_steps(const RecordingSummary& summary, const std::string& file) {
  const std::vector<RecordedSensor> sensors = sensors_of(summary);
  const auto first_of = [&](SeriesKind kind) {
    return std::find_if(sensors.begin(), sensors.end(),
                        [&](const RecordedSensor& sensor) { return sensor.kind == kind; });
  };
  const auto labels = summary.facts.find("text columns");
  std::string words = labels == summary.facts.end() ? "" : labels->second;
  std::transform(words.begin(), words.end(), words.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool is_labelled =
      words.find("rest") != std::string::npos && words.find("fence") != std::string::npos;
  if (is_labelled) {
    return next_of(formatted("calibrate {}{} -o calibration.json", file,
                             sensors.empty() ? " --instrument accelerometer" : ""));
  }
  const auto accelerometer = first_of(SeriesKind::accelerometer);
  if (accelerometer != sensors.end()) {
    return next_for_accelerometer(summary, *accelerometer, sensors, file);
  }
  const auto magnetometer = first_of(SeriesKind::magnetometer);
  if (magnetometer != sensors.end()) {
    return "the magnitude of the field is unknown, so this command assumes 1; give the magnitude "
           "with\n"
           "--field-magnitude 48 --field-unit uT, or the site with --latitude and --longitude\n" +
           next_for_turned(*magnetometer, "magnetometer", file);
  }
  const auto gyroscope = first_of(SeriesKind::gyroscope);
  if (gyroscope != sensors.end()) {
    const bool timed = has_times(summary.series[gyroscope->series]);
    return std::string(timed ? "if the gyroscope is at rest:\n"
                             : "if the gyroscope is at rest (replace 100 by the number of samples "
                               "per second):\n") +
           next_of(formatted("noise {}{}", file, timed ? "" : " --rate 100"));
  }
  return summary.series.empty() ? "the file does not contain numbers\n"
                                : next_for_unknown(summary, file);
}

int run(const LogCommand& command) {
  take_definitions(command.definitions);
  const RecordingSummary summary = summarise(command.log, {}, limits_of(command.limits));
  if (command.json) {
    write_text(command.output, recording_json(summary));
    return 0;
  }
  std::string text =
      formatted("{}: {}, {} series\n\n", command.log, summary.format, summary.series.size());
  text += series_table(summary) + '\n';
  for (const RecordedSensor& sensor : sensors_of(summary)) {
    text += words_of(sensor) + '\n';
  }
  text += next_steps(
      summary, quoted(command.log) +
                   (command.definitions ? " --definitions " + quoted(*command.definitions) : ""));
  write_text(command.output, text);
  for (const std::string& note : summary.notes) {
    print_remark("note", note);
  }
  return 0;
}

}  // namespace

Subcommand log_subcommand() {
  return make_subcommand<LogCommand>(
      "log", "show the content of a file: sensors, rates, gaps",
      "Reads tables (text, .npy, .npz, .mat, .xlsx, JSON), flight logs (ULog,\n"
      "DataFlash, tlog, blackbox), bags (ROS 1, ROS 2, MCAP), recordings from phones,\n"
      "and the output of devices.",
      &add_options, &run);
}

}  // namespace axiscal::cli
