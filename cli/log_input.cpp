// SPDX-License-Identifier: Apache-2.0
#include "log_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/time_column.hpp"
#include "core/formatted.hpp"
#include "sheet_options.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

// Returns the three names of columns in the value of an option.
std::vector<std::string> three_columns(const char* option, const std::string& text) {
  std::vector<std::string> names = names_of(text);
  if (names.size() != 3) {
    throw UsageError(formatted("{}: '{}' must be three columns, X,Y,Z", option, text));
  }
  return names;
}

}  // namespace

void add_log_options(OptionSet& options, LogOptions& log) {
  add_table_options(options, log.table);
  OptionSet log_options = options.group("Log");
  log_options.add("--rate", log.rate, "HZ", "samples per second, instead of a column of times");
  log_options.add("--instance", log.instance, "N",
                  "number of the sensor, counted from 0, if a recording has several of a kind");
}

void add_unit_options(OptionSet& options, UnitOptions& units) {
  OptionSet group = options.group("Units of the readings, if the file does not contain them");
  group.add("--unit", units.all, "UNIT", "unit of all readings");
  group.add("--accelerometer-unit", units.accelerometer, "UNIT",
            "unit of the accelerometer: m/s^2, g, ..");
  group.add("--gyroscope-unit", units.gyroscope, "UNIT", "unit of the gyroscope: deg/s, rad/s, ..");
  group.add("--magnetometer-unit", units.magnetometer, "UNIT",
            "unit of the magnetometer: uT, gauss, ..");
}

void add_rest_options(OptionSet& options, RestOptions& rests) {
  add_log_options(options, rests.log);
  OptionSet log = options.group("Log");
  log.add("--columns", rests.columns, "A,B,..",
          "columns whose variance distinguishes rest from motion; by default, `segment` uses the "
          "columns of --accelerometer, otherwise x,y,z, and `calibrate` uses the gyroscope's "
          "columns, otherwise the accelerometer's");
  log.add("--window", rests.window, "S",
          "length of the sliding window [s]; half a window is left out at both ends of a rest "
          "[default: 0.5]");
  log.add("--min-length", rests.shortest, "S",
          "shortest length of a rest after trimming [s] [default: 1]");
  log.add("--trim", rests.trim, "S",
          "additional time to leave out at both ends of a rest [s] [default: 0.1]");
  log.add("--threshold", rests.threshold, "V",
          "threshold of the variance; while the variance is below it, the instrument is at rest "
          "[default: chosen from the data]");
  log.add("--plan", rests.plan, "SHEET", "run sheet that lists the cube's seats in order");
  log.add("--regions", rests.regions, "FILE|COLUMN",
          "with `calibrate`: known rests and whole turns, from a file (axiscal-regions, JSON) or "
          "from the log's column that names them (x_p, x_a, x_rot)");
  log.add("--first-fence", rests.first_fence, "FACE",
          "face at the fence in the first rest, if seats are recognised");
  log.add("--accelerometer", rests.accelerometer, "X,Y,Z",
          "columns of the accelerometer [default: ax,ay,az]");
  log.add(
      "--gyroscope", rests.gyroscope, "X,Y,Z",
      "columns of the gyroscope; `calibrate` uses gx,gy,gz if these columns exist [default: none]");
  log.add("--magnetometer", rests.magnetometer, "X,Y,Z",
          "columns of the magnetometer; `calibrate` uses mx,my,mz if these columns exist [default: "
          "none]");
  log.add("--gyroscope-scale", rests.gyroscope_scale, "RATE",
          "approximate rad/s per unit of the gyroscope [default: chosen from the usual scales]");
}

std::vector<std::string> stated_options_of(const RestOptions& rests) {
  const std::array<std::pair<const char*, const std::optional<std::string>*>, 14> all = {
      {{"--rate", &rests.log.rate},
       {"--instance", &rests.log.instance},
       {"--columns", &rests.columns},
       {"--window", &rests.window},
       {"--min-length", &rests.shortest},
       {"--trim", &rests.trim},
       {"--threshold", &rests.threshold},
       {"--plan", &rests.plan},
       {"--regions", &rests.regions},
       {"--first-fence", &rests.first_fence},
       {"--accelerometer", &rests.accelerometer},
       {"--gyroscope", &rests.gyroscope},
       {"--magnetometer", &rests.magnetometer},
       {"--gyroscope-scale", &rests.gyroscope_scale}}};
  std::vector<std::string> stated;
  for (const auto& [name, value] : all) {
    if (*value) {
      stated.emplace_back(name);
    }
  }
  return stated;
}

std::vector<std::string> names_of(const std::string& text) {
  std::vector<std::string> names;
  for (const std::string_view name : split(text, ',')) {
    names.emplace_back(trimmed(name));
  }
  return names;
}

LogFormat format_of(const LogOptions& options, const std::vector<std::string>& wanted) {
  LogFormat format = format_of(options.table);
  format.wanted = wanted;
  if (options.table.temperature_column) {
    format.columns.push_back({.name = "temperature", .column = *options.table.temperature_column});
  }
  if (options.instance) {
    format.instance = parse_whole_number("--instance", *options.instance, 0);
  }
  return format;
}

std::vector<std::string> columns_named_by(const RestOptions& options) {
  std::vector<std::string> named;
  for (const std::optional<std::string>* option :
       {&options.columns, &options.accelerometer, &options.gyroscope, &options.magnetometer}) {
    if (*option) {
      const std::vector<std::string> names = names_of(**option);
      named.insert(named.end(), names.begin(), names.end());
    }
  }
  return named;
}

SegmentOptions segment_options_of(const RestOptions& options) {
  SegmentOptions segment;
  segment.time = options.log.table.time.value_or("");
  if (options.columns) {
    segment.columns = names_of(*options.columns);
  }
  if (options.log.rate) {
    if (options.log.table.time) {
      throw UsageError("give either --rate or --time");
    }
    segment.rate_hz = parse_positive("--rate", *options.log.rate);
  }
  if (options.window) {
    segment.window_s = parse_positive("--window", *options.window);
  }
  if (options.shortest) {
    segment.shortest_s = parse_positive("--min-length", *options.shortest);
  }
  if (options.trim) {
    segment.trim_s = parse_nonnegative("--trim", *options.trim);
  }
  if (options.threshold) {
    segment.threshold = parse_positive("--threshold", *options.threshold);
  }
  if (options.range) {
    segment.range = range_of("--range", *options.range);
  }
  return segment;
}

ImuOptions imu_options_of(const RestOptions& options,
                          const std::vector<std::string>& accelerometer) {
  ImuOptions imu;
  imu.segment = segment_options_of(options);
  imu.accelerometer = options.accelerometer
                          ? three_columns("--accelerometer", *options.accelerometer)
                          : accelerometer;
  if (options.gyroscope) {
    imu.gyroscope = three_columns("--gyroscope", *options.gyroscope);
  }
  if (options.magnetometer) {
    imu.magnetometer = three_columns("--magnetometer", *options.magnetometer);
  }
  if (options.gyroscope_scale) {
    imu.turns.rate_per_unit = parse_positive("--gyroscope-scale", *options.gyroscope_scale);
  }
  if (options.first_fence) {
    imu.first = parse_face(*options.first_fence);
    if (!imu.first) {
      throw UsageError(
          formatted("--first-fence: '{}' is not a face; the faces are +X -X +Y -Y +Z -Z",
                    *options.first_fence));
    }
  }
  if (options.plan) {
    imu.sheet = read_sheet_file(*options.plan);
    imu.seats = Seats::sheet;
  }
  return imu;
}

const LogSensor* LogInput::sensor(SeriesKind kind) const {
  const auto found = std::find_if(sensors.begin(), sensors.end(),
                                  [&](const LogSensor& one) { return one.kind == kind; });
  return found == sensors.end() ? nullptr : &*found;
}

LogInput record_log(const std::string& path, const LogFormat& format) {
  return record_log(LogFile(path, format));
}

LogInput record_log(LogFile file) {
  LogInput input{.log = RecordedLog{.name = file.path(), .columns = file.columns()},
                 .sensors = file.sensors(),
                 .stated_rate_hz = file.stated_rate_hz(),
                 .has_parts = file.has_text_column("part"),
                 .time = file.time_column()};
  // A column "X (m/s^2)" is renamed to "X" if no other column then has this name.
  for (LogSensor& sensor : input.sensors) {
    for (std::string& column : sensor.columns) {
      const std::string plain = named_column(column).name;
      const auto calls = std::count_if(
          input.log.columns.begin(), input.log.columns.end(),
          [&](const std::string& other) { return named_column(other).name == plain; });
      if (plain != column && calls == 1) {
        std::replace(input.log.columns.begin(), input.log.columns.end(), column, plain);
        column = plain;
      }
    }
  }
  input.log.samples = read_log(file);
  input.log.notes = file.notes();
  return input;
}

LogInput record_logs(const std::vector<std::string>& paths, const LogFormat& format) {
  LogInput all = record_log(paths.front(), format);
  const std::optional<std::size_t> time = find_column(all.log.columns, all.time);
  for (std::size_t file = 1; file < paths.size(); ++file) {
    LogInput next = record_log(paths[file], format);
    if (next.log.columns != all.log.columns) {
      throw DataError(paths[file], formatted("the columns differ from those of {}: {}",
                                             paths.front(), joined(next.log.columns)));
    }
    if (next.log.samples.front().empty()) {
      continue;
    }
    all.begins.push_back(all.log.samples.front().size());
    if (time && !all.log.samples[*time].empty()) {
      std::vector<double>& times = next.log.samples[*time];
      const double step = usual_step(all.log.samples[*time]);
      const double shift =
          all.log.samples[*time].back() + (std::isfinite(step) ? step : 1.0) - times.front();
      for (double& t : times) {
        t += shift;
      }
    }
    for (std::size_t c = 0; c < all.log.samples.size(); ++c) {
      all.log.samples[c].insert(all.log.samples[c].end(), next.log.samples[c].begin(),
                                next.log.samples[c].end());
    }
    for (const std::string& note : next.log.notes) {
      if (std::find(all.log.notes.begin(), all.log.notes.end(), note) == all.log.notes.end()) {
        all.log.notes.push_back(note);
      }
    }
  }
  return all;
}

void print_remarks_of(const Segmentation& rests,
                      const std::vector<std::string>& more_notes,
                      const SeatLabels* labels) {
  const auto print = [](const char* what, const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      print_remark(what, text);
    }
  };
  print("note", rests.notes);
  print("note", more_notes);
  print("warning", rests.warnings);
  if (labels != nullptr) {
    print("warning", labels->messages);
  }
}

}  // namespace axiscal::cli
