// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/reading_list.hpp"

#include <algorithm>

#include "acquisition/src/journal_point.hpp"
#include "axiscal/core/timestamp.hpp"
#include "field/field_json.hpp"

namespace axiscal {
ReadingList::ReadingList(const std::vector<RunSheetRow>& sheet) : replicate_size_(0) {
  for (const RunSheetRow& row : sheet) {
    steps_.push_back({.row = row, .skipped = false, .run = {}});
    replicate_size_ += row.block == sheet.back().block ? 1U : 0U;
  }
}

Json ReadingList::captured(const CapturedReading& reading) {
  Json entry = {{"entry", "captured"}, {"run", reading.run}, {"step", reading.step}};
  put_point(entry, reading.row.entry.point);
  entry.update({{"block", reading.row.block},
                {"level", level_json(reading.row.entry.level)},
                {"mean", json_from(reading.mean)},
                {"sd", json_from(reading.sd)},
                {"samples", reading.samples},
                {"start", reading.start_s},
                {"end", reading.end_s}});
  if (reading.temperature) {
    entry["temperature"] = reading.temperature->has_own() ? Json(reading.temperature->of_axes())
                                                          : Json(reading.temperature->mean());
  }
  entry["at"] = timestamp_now();
  return entry;
}

Json ReadingList::dropped(int run, const std::string& why) {
  return {{"entry", "dropped"}, {"run", run}, {"why", why}, {"at", timestamp_now()}};
}

Json ReadingList::skipped(std::size_t step) {
  return {{"entry", "skipped"}, {"step", step}, {"at", timestamp_now()}};
}

Json ReadingList::replicate() {
  return {{"entry", "replicate"}, {"at", timestamp_now()}};
}

Json ReadingList::finished() {
  return {{"entry", "finished"}, {"at", timestamp_now()}};
}

void ReadingList::apply(const Json& entry) {
  apply(parse_json(entry.dump(), "session"));
}

void ReadingList::apply(const JsonValue& entry) {
  const std::string kind = entry.at("entry").text();
  const auto step_of = [&]() -> std::size_t {
    const int step = entry.at("step").integer();
    if (step < 0 || static_cast<std::size_t>(step) >= steps_.size()) {
      entry.at("step").fail("this step does not exist");
    }
    return static_cast<std::size_t>(step);
  };
  if (kind == "captured") {
    CapturedReading reading{.run = entry.at("run").integer(),
                            .step = step_of(),
                            .row = steps_[step_of()].row,
                            .mean = entry.at("mean").vector(),
                            .sd = {},
                            .temperature = {}};
    reading.row.entry.point = point_of(entry);
    reading.sd = entry.at("sd").vector(reading.mean.size());
    reading.samples = entry.at("samples").count();
    reading.start_s = entry.at("start").number();
    reading.end_s = entry.at("end").number();
    if (const std::optional<JsonValue> temperature = entry.find("temperature")) {
      if (temperature->is_array()) {
        const Eigen::VectorXd all = temperature->vector(reading.mean.size());
        reading.temperature = SensorTemperature(std::vector<double>(all.begin(), all.end()));
      } else {
        reading.temperature = temperature->number();
      }
    }
    if (reading.run <= last_run_ || steps_[reading.step].run) {
      entry.at("run").fail(
          "a reading with this run number, or of this step, is already in the journal");
    }
    last_run_ = reading.run;
    steps_[reading.step].run = reading.run;
    steps_[reading.step].skipped = false;
    readings_.push_back(std::move(reading));
  } else if (kind == "dropped") {
    const int run = entry.at("run").integer();
    const auto found =
        std::find_if(readings_.begin(), readings_.end(),
                     [run](const CapturedReading& reading) { return reading.run == run; });
    if (found == readings_.end()) {
      entry.at("run").fail("there is no reading with this run number");
    }
    steps_[found->step].run.reset();
    readings_.erase(found);
    finished_ = false;
  } else if (kind == "skipped") {
    steps_[step_of()].skipped = true;
  } else if (kind == "replicate" && !steps_.empty()) {
    const int block = steps_.back().row.block + 1;
    const std::size_t first = steps_.size() - replicate_size_;
    for (std::size_t i = 0; i < replicate_size_; ++i) {
      SessionStep step{.row = steps_[first + i].row, .skipped = false, .run = {}};
      step.row.run = static_cast<int>(steps_.size()) + 1;
      step.row.block = block;
      steps_.push_back(step);
    }
    finished_ = false;
  } else if (kind == "finished") {
    finished_ = true;
  }
}

std::optional<std::size_t> ReadingList::next() const {
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    if (!steps_[i].run && !steps_[i].skipped) {
      return i;
    }
  }
  return {};
}

std::optional<std::size_t> ReadingList::waiting_for(const DesignPoint& point,
                                                    std::size_t of_block) const {
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const SessionStep& step = steps_[i];
    if (!step.run && !step.skipped && step.row.entry.point == point &&
        step.row.block == steps_[of_block].row.block &&
        step.row.entry.level == steps_[of_block].row.entry.level) {
      return i;
    }
  }
  return {};
}

const CapturedReading* ReadingList::find(int run) const {
  const auto found =
      std::find_if(readings_.begin(), readings_.end(),
                   [run](const CapturedReading& reading) { return reading.run == run; });
  return found == readings_.end() ? nullptr : &*found;
}

std::size_t ReadingList::left() const {
  return static_cast<std::size_t>(
      std::count_if(steps_.begin(), steps_.end(),
                    [](const SessionStep& step) { return !step.run && !step.skipped; }));
}

Observations ReadingList::observations(Eigen::Index axis_count) const {
  Observations result;
  const auto n = static_cast<Eigen::Index>(readings_.size());
  result.response = Eigen::MatrixXd(n, axis_count);
  result.samples = Eigen::VectorXd(n);
  result.response_sd = Eigen::MatrixXd(n, axis_count);
  for (Eigen::Index i = 0; i < n; ++i) {
    const CapturedReading& reading = readings_[static_cast<std::size_t>(i)];
    result.readings.push_back({.run = reading.run,
                               .block = reading.row.block,
                               .point = reading.row.entry.point,
                               .level = reading.row.entry.level,
                               .temperature = reading.temperature,
                               .time_s = 0.5 * (reading.start_s + reading.end_s),
                               .field_in_sensor = {}});
    result.response.row(i) = reading.mean.transpose();
    result.response_sd->row(i) = reading.sd.transpose();
    (*result.samples)(i) = static_cast<double>(reading.samples);
    result.has_level = result.has_level || reading.row.entry.level != FieldLevel(1.0);
    result.has_block = result.has_block || reading.row.block != readings_.front().row.block;
  }
  return result;
}

}  // namespace axiscal
