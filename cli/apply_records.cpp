// SPDX-License-Identifier: Apache-2.0
#include "apply_records.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/field/field_unit.hpp"
#include "axiscal/logs/log_file.hpp"
#include "core/formatted.hpp"
#include "input.hpp"
#include "summary.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

// A record, and the columns of the log with the readings of the record's instrument.
struct Corrected {
  Calibration calibration;
  Reducer reducer;
  std::array<std::string, 3> columns;
  std::array<std::size_t, 3> places{};
  double factor = 1.0;  // converts readings from the log's unit to the record's unit
};

Corrected of_record(const std::string& path,
                    const std::string& log,
                    const std::vector<LogSensor>& sensors,
                    bool force) {
  Calibration calibration = in_assembly_frame(read_unrefused(path, force));
  const Instrument& instrument = calibration.sensor.instrument;
  if (instrument.axis_count() != 3 || !instrument.differences.empty()) {
    throw UsageError(path +
                     ": if several records are given, each must be of a three-axis sensor; apply "
                     "this record separately");
  }
  const std::vector<SeriesKind> kinds = kinds_of(instrument.kind);
  const auto sensor = std::find_if(sensors.begin(), sensors.end(), [&](const LogSensor& one) {
    return !kinds.empty() && one.kind == kinds.front();
  });
  if (sensor == sensors.end()) {
    throw DataError(log, formatted("the log contains no {}, for which the record {} was "
                                   "made",
                                   instrument.kind, path));
  }
  std::optional<double> factor;
  if (!sensor->unit.empty() && !instrument.unit.empty() && instrument.unit != "1") {
    factor = reading_factor_between(sensor->unit, instrument.unit);
    if (!factor && is_reading_unit(sensor->unit) && is_reading_unit(instrument.unit)) {
      throw DataError(log, formatted("the readings of the {} are in {}, but those of the record {} "
                                     "are in {}",
                                     name_of(sensor->kind), sensor->unit, path, instrument.unit));
    }
  }
  Reducer reducer(calibration, {}, force ? Force::yes : Force::no);
  return {.calibration = std::move(calibration),
          .reducer = std::move(reducer),
          .columns = sensor->columns,
          .places = {},
          .factor = factor.value_or(1.0)};
}

}  // namespace

void apply_records(const std::vector<std::string>& records,
                   const std::string& log,
                   const TableOptions& table,
                   const std::string& output,
                   bool force) {
  LogFormat format = format_of(table);
  LogFile file(log, format);
  const std::vector<LogSensor> sensors = file.sensors();
  const std::string time = table.time.value_or(file.time_column());
  std::vector<Corrected> all;
  std::set<std::string> kinds;
  for (const std::string& record : records) {
    all.push_back(of_record(record, log, sensors, force));
    if (!kinds.insert(all.back().calibration.sensor.instrument.kind).second) {
      throw UsageError(
          formatted("{}: this is a second record of a sensor of the kind {}; give only one record "
                    "for each kind of sensor",
                    record, all.back().calibration.sensor.instrument.kind));
    }
  }
  std::vector<std::size_t> selected;
  std::string header;
  const auto select = [&](const std::string& column) {
    selected.push_back(file.need(column));
    return selected.size() - 1;
  };
  if (!time.empty()) {
    header = formula_safe_cell(time);
    select(time);
  }
  for (Corrected& one : all) {
    std::vector<std::string> names;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      one.places[axis] = select(one.columns[axis]);
      header += (header.empty() ? "" : ",") + formula_safe_cell(one.columns[axis]);
      names.push_back(one.columns[axis]);
    }
    print_remark("note", formatted("the columns {} are corrected by the record of the {}; their "
                                   "unit is {}",
                                   joined(names), one.calibration.sensor.instrument.kind,
                                   one.calibration.sensor.field.unit));
  }
  const std::optional<std::size_t> temperature = find_column(file.columns(), "temperature");
  const std::size_t temperature_place = temperature ? selected.size() : 0;
  if (temperature) {
    selected.push_back(*temperature);
  }
  for (const Corrected& one : all) {
    if (one.reducer.needs_temperature() && !temperature) {
      print_remark("note", formatted("the log lacks the column 'temperature': the {} is corrected "
                                     "at the record's reference temperature",
                                     one.calibration.sensor.instrument.kind));
    }
  }
  file.select(selected);
  OutputFile out(output, OutputFile::Mode::replace_whole);
  out.write(header + "\n");
  LogBlock block;
  constexpr std::size_t rows_at_once = 4096;
  while (const std::size_t rows = file.read(block, rows_at_once)) {
    std::string text;
    for (std::size_t row = 0; row < rows; ++row) {
      std::string line = time.empty() ? "" : number_text(block[0][row]);
      for (const Corrected& one : all) {
        std::array<double, 3> reading{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          reading[axis] = one.factor * block[one.places[axis]][row];
        }
        ReadingContext context;
        if (one.reducer.needs_temperature() && temperature &&
            std::isfinite(block[temperature_place][row])) {
          context.temperature = block[temperature_place][row];
        }
        const bool is_whole = std::all_of(reading.begin(), reading.end(),
                                          [](double value) { return std::isfinite(value); });
        const Eigen::Vector3d field = is_whole
                                          ? one.reducer.reduce(reading, context).field_in_sensor
                                          : Eigen::Vector3d::Constant(not_a_number);
        for (const double value : field) {
          line += (line.empty() ? "" : ",") + (std::isfinite(value) ? number_text(value) : "nan");
        }
      }
      text += line + "\n";
    }
    out.write(text);
  }
  out.commit();
  for (const std::string& note : file.notes()) {
    print_remark("note", log + ": " + note);
  }
}

}  // namespace axiscal::cli
