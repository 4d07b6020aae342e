// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/run.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <map>
#include <numeric>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void check_same_unit(const Run& run, const Run& file) {
  if (!run.serial.empty() && !file.serial.empty() && run.serial != file.serial) {
    throw DataError(file.inputs.front().path,
                    formatted("column 'serial': '{}', but an earlier file is of unit "
                              "'{}'; give only files of one unit",
                              file.serial, run.serial));
  }
}

void note_ignored_columns(const Run& file, std::vector<std::string>& notes) {
  const std::vector<std::string>& ignored = file.ignored_columns;
  if (!ignored.empty()) {
    const bool one = ignored.size() == 1;
    notes.push_back(formatted("{}: {}{}{} ignored", file.inputs.front().path,
                              one ? "column " : "columns ", joined(ignored),
                              one ? " was" : " were"));
  }
}

// Appends a file's column of texts to the columns of earlier files. If a file lacks the column, its
// readings get an empty text.
void join_texts(std::vector<std::string> texts,
                std::size_t size,
                std::size_t size_before,
                std::vector<std::string>& joined_texts) {
  if (texts.empty() && joined_texts.empty()) {
    return;
  }
  joined_texts.resize(size_before);
  texts.resize(size);
  joined_texts.insert(joined_texts.end(), std::make_move_iterator(texts.begin()),
                      std::make_move_iterator(texts.end()));
}

}  // namespace

std::string measured_at(const Run& run) {
  if (!run.measured.empty()) {
    return run.measured;
  }
  const std::vector<Reading>& readings = run.observations.readings;
  double last_s = 0.0;
  for (const Reading& reading : readings) {
    last_s = std::max(last_s, reading.time_s.value_or(0.0));
  }
  if (is_utc(last_s)) {
    return timestamp_of(last_s);
  }
  std::string last;
  for (const std::string& date : run.dates) {
    last = std::max(last, date);
  }
  return last;
}

std::string operators_of(const Run& run) {
  std::vector<std::string> names;
  for (const std::string& name : run.operators) {
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end()) {
      names.push_back(name);
    }
  }
  return joined(names);
}

Run read_run(const std::string& path, const ObservationColumns& columns) {
  InputFile file(path);
  CsvReader csv([&](char* to, std::size_t size) { return file.read(to, size); }, path);
  ObservationColumns wanted = columns;
  const bool any_axes = columns.axes == ObservationColumns().axes && columns.differences.empty();
  if (any_axes && !csv.column("x") && !csv.column("y") && !csv.column("z")) {
    const std::vector<std::string> own = unknown_columns(csv.header());
    wanted.axes = own.empty() ? wanted.axes : own;
  }
  Run run = read_observations(csv, wanted);
  run.inputs = {{.path = path, .sha256 = {}}};
  note_ignored_columns(run, run.notes);
  return run;
}

Run make_run(std::span<const DesignPoint> points,
             const Eigen::Ref<const Eigen::MatrixXd>& response) {
  if (static_cast<Eigen::Index>(points.size()) != response.rows()) {
    throw DomainError(
        formatted("make_run: {} design points for {} readings", points.size(), response.rows()));
  }
  Run run;
  run.observations.response = response;
  for (const DesignPoint& point : points) {
    const int number = static_cast<int>(run.observations.readings.size()) + 1;
    run.observations.readings.push_back({.run = number, .point = point});
  }
  return run;
}

ObservationColumns observation_columns(const Experiment& experiment, Units units) {
  const Method method = experiment.fit.method.value_or(Method::known);
  std::vector<SlotColumns> slots;
  for (const SlotSetup& slot : experiment.slots) {
    slots.push_back({.slot = slot.slot, .axes = slot.instrument.axes});
  }
  return {.axes = experiment.instrument.axes,
          .slots = std::move(slots),
          .face_names = experiment.face_names,
          .differences = experiment.instrument.differences,
          .range = experiment.instrument.range,
          .needs_labels = method_kind(method).by_pose && !method_kind(method).directions_known,
          .needs_samples = experiment.fit.weighting == Weighting::samples,
          .needs_temperature =
              experiment.fit.temperature.order > 0 || experiment.fit.temperature.automatic,
          .takes_several_units = units == Units::several,
          .needs_sd = experiment.fit.weighting == Weighting::sd};
}

Run join_runs(std::vector<Run> files, Units units) {
  Run run;
  std::vector<Observations> parts;
  std::string without_serial;  // path of a file without the column 'serial'
  std::size_t size = 0;        // number of readings in the files so far
  for (Run& file : files) {
    if (units == Units::one) {
      check_same_unit(run, file);
    }
    if (!parts.empty() && run.slots != file.slots) {
      throw DataError(file.inputs.front().path,
                      "the slots in the names of the columns differ from the slots in the first "
                      "file");
    }
    without_serial = file.serials.empty() ? file.inputs.front().path : without_serial;
    run.slots = file.slots;
    run.axes_of_slots = file.axes_of_slots;
    run.serial = run.serial.empty() ? file.serial : run.serial;
    note_ignored_columns(file, run.notes);
    run.inputs.insert(run.inputs.end(), file.inputs.begin(), file.inputs.end());
    run.axes = file.axes;
    run.field_unit = file.field_unit;
    if (run.serials.empty()) {
      run.serials = std::move(file.serials);
    } else {
      run.serials.insert(run.serials.end(), file.serials.begin(), file.serials.end());
    }
    run.measured = std::max(run.measured, file.measured);
    const std::size_t own_size = file.observations.readings.size();
    run.rows_of_inputs.push_back(own_size);
    join_texts(std::move(file.dates), own_size, size, run.dates);
    join_texts(std::move(file.operators), own_size, size, run.operators);
    size += own_size;
    run.notes.insert(run.notes.end(), file.notes.begin(), file.notes.end());
    parts.push_back(std::move(file.observations));
  }
  if (!without_serial.empty()) {
    if (has_several_units(run)) {
      throw DataError(without_serial,
                      "column 'serial' is missing; add it, because the files contain "
                      "readings of units with different serial numbers");
    }
    run.serials.clear();  // all readings are of one unit
  }
  run.observations = concatenate(std::move(parts));
  return run;
}

bool has_several_units(const Run& run) {
  return std::any_of(run.serials.begin(), run.serials.end(),
                     [&](const std::string& serial) { return serial != run.serials.front(); });
}

UnitsOfRun::UnitsOfRun(Run run, const std::string& stated_serial) : run_(std::move(run)) {
  if (run_.serials.empty()) {
    serials_.push_back(stated_serial.empty() ? run_.serial : stated_serial);
    return;
  }
  // A file may have thousands of units, so each row is visited only once.
  const std::vector<std::string> of_rows = std::exchange(run_.serials, {});
  std::unordered_map<std::string_view, std::size_t> places;
  std::vector<std::size_t> units;  // index of the unit of each row
  units.reserve(of_rows.size());
  for (const std::string& serial : of_rows) {
    const auto [found, is_new] = places.emplace(serial, serials_.size());
    if (is_new) {
      serials_.push_back(serial);
    }
    units.push_back(found->second);
  }
  begins_.resize(serials_.size() + 1);
  for (const std::size_t unit : units) {
    ++begins_[unit + 1];
  }
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  rows_.resize(units.size());
  std::vector<std::size_t> next = begins_;
  for (std::size_t i = 0; i < units.size(); ++i) {
    rows_[next[units[i]]++] = i;
  }
}

std::size_t UnitsOfRun::readings(std::size_t unit) const {
  return rows_.empty() ? run_.observations.readings.size() : begins_[unit + 1] - begins_[unit];
}

std::size_t UnitsOfRun::usual_readings() const {
  std::map<std::size_t, std::size_t> counts;
  for (std::size_t unit = 0; unit < size(); ++unit) {
    ++counts[readings(unit)];
  }
  std::size_t usual = 0;
  for (const auto& [count, units] : counts) {
    usual = usual == 0 || units >= counts[usual] ? count : usual;
  }
  return usual;
}

Run UnitsOfRun::operator[](std::size_t unit) const {
  const std::string& serial = serials_[unit];
  if (rows_.empty()) {
    Run only = run_;
    only.serial = serial;
    return only;
  }
  const auto row = [&](std::size_t at) { return rows_.begin() + static_cast<std::ptrdiff_t>(at); };
  const std::vector<std::size_t> rows(row(begins_[unit]), row(begins_[unit + 1]));
  const auto texts_of = [&](const std::vector<std::string>& of_rows) {
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < rows.size() && !of_rows.empty(); ++i) {
      texts.push_back(of_rows[rows[i]]);
    }
    return texts;
  };
  return {.observations = select_rows(run_.observations, rows),
          .inputs = run_.inputs,
          .notes = run_.notes,
          .axes = run_.axes,
          .field_unit = run_.field_unit,
          .serial = serial,
          .serials = std::vector<std::string>(rows.size(), serial),
          .dates = texts_of(run_.dates),
          .operators = texts_of(run_.operators),
          .measured = run_.measured,
          .slots = run_.slots,
          .axes_of_slots = run_.axes_of_slots};
}

std::vector<Run> split_by_serial(const Run& run, const std::string& stated_serial) {
  const UnitsOfRun units(run, stated_serial);
  std::vector<Run> all;
  for (std::size_t i = 0; i < units.size(); ++i) {
    all.push_back(units[i]);
  }
  return all;
}

}  // namespace axiscal
