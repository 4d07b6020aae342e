// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cmath>

#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/logs/recorded_sensor.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "subcommands.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

struct LogCommand {
  std::string log;
  std::string output = "-";
  bool json = false;
};

void add_options(OptionSet& options, LogCommand& command) {
  options.add("log", command.log, "FILE", "of any format; - is stdin", Need::required);
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of a table");
}

std::string full_name(const SeriesSummary& one) {
  return one.series.instance > 0 ? formatted("{}[{}]", one.series.name, one.series.instance)
                                 : one.series.name;
}

std::string columns_text(const SeriesSummary& one) {
  constexpr std::size_t most = 4;
  std::vector<std::string> columns = one.series.columns;
  if (columns.size() > most) {
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
    text += formatted(
        "{:<{}}  {:<13}  {:>9}  {:>9}  {:>10}  {:<7} {}{}\n", full_name(one), width,
        name_of(one.series.kind), one.samples,
        std::isfinite(one.rate_hz) ? number_text(one.rate_hz, 4) : "-",
        has_times ? number_text(one.end_s - one.start_s, 5) : "-",
        one.series.unit.empty() ? "-" : one.series.unit, columns_text(one),
        std::string(one.gaps > 0 ? formatted("; {} gaps", one.gaps) : "") +
            (one.series.kind != SeriesKind::other && is_constant(one) ? "; does not vary" : ""));
  }
  return text;
}

// The name of a file as a shell takes it.
std::string quoted(const std::string& path) {
  const bool is_plain = path.find_first_of(" '\"()[]{}*?&;|<>$`\\!#~") == std::string::npos;
  return is_plain ? path : "'" + path + "'";
}

// What to type next for what is in the file.
std::string next_steps(const RecordingSummary& summary, const std::string& path) {
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
  const std::string file = quoted(path);
  if (is_labelled) {
    return formatted("next: axiscal calibrate {}{} -o calibration.json\n", file,
                     sensors.empty() ? " --instrument accelerometer" : "");
  }
  const auto accelerometer = first_of(SeriesKind::accelerometer);
  const auto magnetometer = first_of(SeriesKind::magnetometer);
  if (accelerometer != sensors.end()) {
    const SeriesSummary& one = summary.series[accelerometer->series];
    const double still_s = one.still_to_s - one.still_from_s;
    const double span_s = one.end_s - one.start_s;
    constexpr double nearly_all = 0.9;
    constexpr double shortest_s = 1.0;
    if (std::isfinite(span_s) && still_s > nearly_all * span_s) {
      return formatted(
          "the accelerometer is still all the time\n"
          "next: axiscal noise {} -o noise.txt\n",
          file);
    }
    if (std::isfinite(span_s) && still_s < shortest_s) {
      return formatted(
          "the accelerometer is never still for a second: to calibrate it, record it while it is "
          "put\ndown in 12 or more different ways, some seconds each; then\n"
          "next: axiscal calibrate --imu LOG -o 'imu-{{slot}}.json'\n");
    }
    return formatted(
        "{}next: axiscal calibrate --imu {} -o 'imu-{{slot}}{}.json'\n",
        std::isfinite(span_s)
            ? formatted("the accelerometer's longest rest is from {} to {} s after its "
                        "first sample\n",
                        number_text(one.still_from_s, 4), number_text(one.still_to_s, 4))
            : std::string("the file has no times: state the rate\n"),
        std::isfinite(span_s) ? file : file + " --rate HZ",
        std::any_of(sensors.begin(), sensors.end(),
                    [](const RecordedSensor& sensor) { return sensor.number > 0; })
            ? "-{instance}"
            : "");
  }
  if (magnetometer != sensors.end()) {
    return formatted(
        "next: axiscal calibrate {} --instrument magnetometer --method magnitude --axes \"{}\" -o "
        "magnetometer.json\n",
        file, joined({magnetometer->columns.begin(), magnetometer->columns.end()}, ","));
  }
  if (first_of(SeriesKind::gyroscope) != sensors.end()) {
    return formatted("next, where it is at rest: axiscal noise {}\n", file);
  }
  return summary.series.empty()
             ? "there are no numbers in it\n"
             : "no accelerometer, gyroscope or magnetometer is known in it by names, units or "
               "numbers; say\nwhich columns are one: --accelerometer X,Y,Z\n";
}

int run(const LogCommand& command) {
  const RecordingSummary summary = summarise(command.log);
  if (command.json) {
    write_whole_file(command.output, recording_json(summary));
    return 0;
  }
  std::string text =
      formatted("{}: {}, {} series\n\n", command.log, summary.format, summary.series.size());
  text += series_table(summary) + '\n';
  for (const RecordedSensor& sensor : sensors_of(summary)) {
    text += words_of(sensor) + '\n';
  }
  text += next_steps(summary, command.log);
  write_whole_file(command.output, text);
  for (const std::string& note : summary.notes) {
    print_remark("note", note);
  }
  return 0;
}

}  // namespace

Subcommand log_subcommand() {
  return make_subcommand<LogCommand>(
      "log", "what is in a file: sensors, rates, gaps, and what to do next",
      "Reads tables (text, .npy, .npz, .mat, .xlsx, JSON), flight logs (ULog, DataFlash, tlog,\n"
      "blackbox), bags (ROS 1, ROS 2, MCAP), phones' recordings, and what devices print.",
      &add_options, &run);
}

}  // namespace axiscal::cli
