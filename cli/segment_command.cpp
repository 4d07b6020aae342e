// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>

#include "axiscal/core/error.hpp"
#include "axiscal/core/output_file.hpp"
#include "column_advice.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "log_input.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

struct SegmentCommand {
  std::string log;
  RestOptions rests;
  std::string output = "-";
  bool recognise = false;
  bool keep_split = false;
  bool json = false;
};

void add_options(OptionSet& options, SegmentCommand& command) {
  options.add("log", command.log, "LOG", "log of any format (see `axiscal log`); - is stdin",
              Need::required);
  add_rest_options(options, command.rests);
  options.add("--range", command.rests.range, "LO,HI",
              "samples at or beyond these limits are saturated");
  options.add_flag("--recognise", command.recognise,
                   "recognise the seats of a cube: the rest faces by --accelerometer (default: the "
                   "three --columns), the fence faces by --gyroscope or --magnetometer");
  options.add_flag(
      "--keep-split", command.keep_split,
      "keep all parts of a rest that was split by a knock; otherwise only the longest is kept");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of CSV");
}

std::string segmentation_json(const Segmentation& rests, const SeatLabels* labels) {
  Json json = {{"threshold", rests.threshold}, {"rate_hz", rests.rate_hz},
               {"samples", rests.samples},     {"broken_samples", rests.broken_samples},
               {"tried", Json::array()},       {"rests", Json::array()},
               {"notes", rests.notes},         {"warnings", rests.warnings}};
  for (const auto& [threshold, count] : rests.tried) {
    json["tried"].push_back({{"threshold", threshold}, {"rests", count}});
  }
  for (std::size_t i = 0; i < rests.intervals.size(); ++i) {
    const StaticInterval& interval = rests.intervals[i];
    Json one = {{"run", i + 1},
                {"start", interval.start_s},
                {"end", interval.end_s},
                {"samples", interval.samples()},
                {"first_sample", interval.first},
                {"marks", rests.marks[i]}};
    for (std::size_t c = 0; c < rests.columns.size(); ++c) {
      const auto at = static_cast<Eigen::Index>(c);
      one["mean"][rests.columns[c]] = interval.mean(at);
      one["sd"][rests.columns[c]] = interval.sd(at);
      one["effective_samples"][rests.columns[c]] = interval.effective_samples(at);
    }
    if (labels != nullptr && labels->points[i]) {
      one["rest"] = face_name(labels->points[i]->rest());
      one["fence"] = face_name(labels->points[i]->fence());
    }
    json["rests"].push_back(std::move(one));
  }
  if (labels != nullptr) {
    json["seats_that_do_not_fit"] = labels->messages;
  }
  return json_text(json);
}

// Returns the columns that are used to find rests. Without an option that states them, they are x,
// y, z. If the log lacks x, y, z, they are the columns of its accelerometer.
std::vector<std::string> columns_of(const RestOptions& rests, LogFile& log) {
  if (rests.columns || rests.accelerometer) {
    return names_of(rests.columns ? *rests.columns : *rests.accelerometer);
  }
  const std::vector<std::string> usual = {"x", "y", "z"};
  const bool has_usual = std::all_of(usual.begin(), usual.end(), [&](const std::string& name) {
    return find_column(log.columns(), name).has_value();
  });
  if (!has_usual) {
    for (const LogSensor& sensor : log.sensors()) {
      if (sensor.kind == SeriesKind::accelerometer) {
        print_remark("note", sensor.words);
        return {sensor.columns.begin(), sensor.columns.end()};
      }
    }
  }
  return usual;
}

int run(const SegmentCommand& command) {
  const LogFormat format = format_of(command.rests.log, columns_named_by(command.rests));
  LogFile log(command.log, format);
  const std::vector<std::string> columns = columns_of(command.rests, log);
  ImuOptions options = imu_options_of(command.rests, columns);
  options.segment.columns = columns;
  if (options.segment.time.empty() && !options.segment.rate_hz) {
    options.segment.time = log.time_column();
    if (options.segment.time.empty()) {
      options.segment.rate_hz = log.stated_rate_hz();
    }
  }
  if (command.rests.accelerometer) {
    options.segment.attitude = options.accelerometer;
  }
  options.segment.join = !command.keep_split;
  if (command.recognise && command.rests.plan) {
    throw UsageError("give either --recognise or --plan");
  }
  const bool labels_wanted = command.recognise || command.rests.plan;
  if (command.recognise && options.accelerometer.size() != 3) {
    throw UsageError(
        "--recognise: requires an accelerometer; give --accelerometer X,Y,Z, or three --columns");
  }
  std::optional<RecordedLog> recorded;
  std::vector<std::string> notes;
  const bool checks_fences =
      command.rests.plan && (command.rests.gyroscope || command.rests.magnetometer);
  if (command.recognise || checks_fences) {
    recorded = RecordedLog{.name = command.log, .columns = log.columns()};
    recorded->samples = read_log(log);
    recorded->notes = log.notes();
    notes = recorded->notes;
    log = LogFile(recorded->name, recorded->columns, recorded->samples);
  }
  std::vector<std::string> needed = options.gyroscope;
  needed.insert(needed.end(), options.magnetometer.begin(), options.magnetometer.end());
  if (labels_wanted) {
    needed.insert(needed.end(), options.accelerometer.begin(), options.accelerometer.end());
  }
  const Segmentation rests =
      with_column_advice(command.rests.accelerometer ? "--accelerometer" : "--columns", "acc", [&] {
        for (const std::string& column : needed) {
          static_cast<void>(log.need(column));
        }
        return segment(log, options.segment);
      });
  std::optional<SeatLabels> labels;
  if (command.rests.plan) {
    labels = label_by_plan(means_of(rests, options.accelerometer), options.sheet,
                           command.rests.accelerometer.has_value());
    if (checks_fences) {
      check_fences(*recorded, rests, options, *labels);
    }
  } else if (command.recognise) {
    labels = recognise_seats(*recorded, rests, options, notes);
  }
  const SeatLabels* const seats = labels ? &*labels : nullptr;
  write_text(command.output, command.json ? segmentation_json(rests, seats)
                                          : segmentation_csv(rests, seats, options.sheet));
  print_remarks_of(rests, notes, seats);
  print_line(
      formatted("{} rest{} found in {:.1f} s ({} samples, {:.5g} Hz); variance threshold {:.4g}",
                rests.intervals.size(), rests.intervals.size() == 1 ? "" : "s",
                static_cast<double>(rests.samples) / rests.rate_hz, rests.samples, rests.rate_hz,
                rests.threshold));
  return 0;
}

}  // namespace

Subcommand segment_subcommand() {
  return make_subcommand<SegmentCommand>(
      "segment", "find the rests of a log, and write them as readings", "", &add_options, &run);
}

}  // namespace axiscal::cli
