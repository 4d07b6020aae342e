// SPDX-License-Identifier: Apache-2.0
// The Python extension axiscal._axiscal. It contains the parts that must be fast or exact. Users
// import the package axiscal in python/axiscal instead.
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/choices.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/run_columns.hpp"
#include "axiscal/calib/summary.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/formulas/formula_field.hpp"
#include "axiscal/logs/allan.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "axiscal/report/calibration_report.hpp"
#include "cli/command_line.hpp"
#include "cli/exchange_options.hpp"
#include "cli/experiment_options.hpp"
#include "cli/input.hpp"
#include "cli/option_names.hpp"
#include "cli/subcommands.hpp"
#include "cli/summary.hpp"
#include "cli/table_options.hpp"
#include "cli/usage_error.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"

namespace py = pybind11;

namespace axiscal::python {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Rows = Eigen::Ref<const RowMajor, 0, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;

// Number of rows that are copied to columns at a time. It is small enough that the columns stay in
// the cache.
constexpr Eigen::Index rows_at_once = 8192;

// Divides the rows into pieces, and calls work(first, count) for each piece. If there are many
// rows, several threads share the pieces.
template <typename Work>
void for_each_rows(Eigen::Index rows, const Work& work) {
  const Eigen::Index pieces = (rows + rows_at_once - 1) / rows_at_once;
  for_each_in_parallel(static_cast<std::size_t>(pieces), [&](std::size_t piece) {
    const Eigen::Index first = static_cast<Eigen::Index>(piece) * rows_at_once;
    work(first, std::min(rows_at_once, rows - first));
  });
}

Eigen::MatrixXd piece_of(const Rows& all, Eigen::Index first, Eigen::Index count) {
  return all.rows() == 0 ? Eigen::MatrixXd() : Eigen::MatrixXd(all.middleRows(first, count));
}

void require_columns(const Rows& readings, std::size_t axes) {
  if (readings.cols() != static_cast<Eigen::Index>(axes)) {
    throw DomainError(
        formatted("readings: expected an array of n x {}, not of n x {}", axes, readings.cols()));
  }
}

void require_temperatures(const Rows& readings, const Rows& temperatures) {
  if (temperatures.rows() != 0 &&
      (temperatures.rows() != readings.rows() ||
       (temperatures.cols() != 1 && temperatures.cols() != readings.cols()))) {
    throw DomainError(formatted("temperature: expected {} values, or {} x {}; got {} x {}",
                                readings.rows(), readings.rows(), readings.cols(),
                                temperatures.rows(), temperatures.cols()));
  }
}

// @param temperatures  n x 1, or n x m if each axis has its own sensor; empty: returns nullopt.
std::optional<SensorTemperature> temperature_of(const Rows& temperatures, Eigen::Index reading) {
  if (temperatures.rows() == 0) {
    return std::nullopt;
  }
  const Eigen::VectorXd own = temperatures.row(reading).transpose();
  return own.size() == 1 ? SensorTemperature(own(0))
                         : SensorTemperature(std::vector<double>(own.begin(), own.end()));
}

// Converts readings to the field.
// @return n x 3 field components; for an instrument with m < 3 axes, n x m components.
RowMajor apply(const Calibration& calibration,
               const Rows& readings,
               const Rows& temperatures,
               bool force) {
  const Reducer reducer(calibration, {}, force ? Force::yes : Force::no);
  require_columns(readings, reducer.axis_count());
  const Eigen::Index axes = readings.cols();
  require_temperatures(readings, temperatures);
  RowMajor result(readings.rows(), reducer.gives_components() ? 3 : axes);
  for_each_rows(readings.rows(), [&](Eigen::Index first, Eigen::Index count) {
    if (reducer.gives_components()) {
      result.middleRows(first, count) = reducer.reduce_rows(readings.middleRows(first, count),
                                                            piece_of(temperatures, first, count));
      return;
    }
    for (Eigen::Index i = first; i < first + count; ++i) {
      const std::optional<SensorTemperature> temperature = temperature_of(temperatures, i);
      for (Eigen::Index k = 0; k < axes; ++k) {
        result(i, k) =
            reducer.reduce_axis(static_cast<std::size_t>(k), readings(i, k), temperature).component;
      }
    }
  });
  return result;
}

// The flags of derived(), as bits.
constexpr std::uint8_t clamped = 1;
constexpr std::uint8_t extrapolated = 2;
constexpr std::uint8_t undetermined = 4;

std::uint8_t flags_if(bool is_clamped, bool is_extrapolated, bool is_undetermined = false) {
  return static_cast<std::uint8_t>((is_clamped ? clamped : 0U) |
                                   (is_extrapolated ? extrapolated : 0U) |
                                   (is_undetermined ? undetermined : 0U));
}

// The names of derived() and their values, and a flag for each reading.
struct DerivedRows {
  std::vector<std::string> names;
  RowMajor values;                  // n x number of names
  std::vector<std::uint8_t> flags;  // n
};

// Like derived(), but for an instrument with fewer than three axes. Each derived value is the angle
// of one axis.
void derive_angles_of_axes(const Reducer& reducer,
                           const Rows& readings,
                           const Rows& temperatures,
                           DerivedRows& derived) {
  for_each_rows(readings.rows(), [&](Eigen::Index first, Eigen::Index count) {
    for (Eigen::Index i = first; i < first + count; ++i) {
      const std::optional<SensorTemperature> temperature = temperature_of(temperatures, i);
      for (Eigen::Index k = 0; k < readings.cols(); ++k) {
        const ReducedAxis axis =
            reducer.reduce_axis(static_cast<std::size_t>(k), readings(i, k), temperature);
        derived.values(i, k) = axis.angle_rad * deg_per_rad;
        derived.flags[static_cast<std::size_t>(i)] |= flags_if(axis.clamped, axis.extrapolated);
      }
    }
  });
}

// @param up  n x 3.
void derive_from_field(const Reducer& reducer,
                       const Rows& readings,
                       const Rows& temperatures,
                       const std::optional<Rows>& up,
                       DerivedRows& derived) {
  for_each_rows(readings.rows(), [&](Eigen::Index first, Eigen::Index count) {
    std::vector<double> reading(reducer.axis_count());
    for (Eigen::Index i = first; i < first + count; ++i) {
      Eigen::VectorXd::Map(reading.data(), readings.cols()) = readings.row(i).transpose();
      if (!readings.row(i).allFinite()) {
        derived.values.row(i).setConstant(std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      ReadingContext context{.temperature = temperature_of(temperatures, i)};
      if (up) {
        context.up = Eigen::Vector3d(up->row(i).transpose());
      }
      const ReducedReading reduced = reducer.reduce(reading, context);
      for (Eigen::Index k = 0; k < derived.values.cols(); ++k) {
        derived.values(i, k) = reduced.derived.values[static_cast<std::size_t>(k)];
      }
      derived.flags[static_cast<std::size_t>(i)] =
          flags_if(reduced.derived.clamped, reduced.extrapolated, !reduced.determined);
    }
  });
}

// Computes the values that are derived from the field for this kind of instrument, such as pitch.
// Returns the names of the d values, the values for each reading (n x d), and the flags of each
// reading (n): `clamped`: a value was clamped; `extrapolated`: the temperature is outside the
// calibrated range; `undetermined`: the reading does not determine the field.
// @param temperatures  n x 1 or n x m; empty: the reference temperature.
// @param up            n x 3.
py::tuple derived(const Calibration& calibration,
                  const Rows& readings,
                  const Rows& temperatures,
                  const std::optional<Rows>& up,
                  bool force) {
  const Reducer reducer(calibration, {}, force ? Force::yes : Force::no);
  require_columns(readings, reducer.axis_count());
  require_temperatures(readings, temperatures);
  if (up && (up->rows() != readings.rows() || up->cols() != 3)) {
    throw DomainError(formatted("up: expected an array of {} x 3, not of {} x {}", readings.rows(),
                                up->rows(), up->cols()));
  }
  DerivedRows derived;
  if (reducer.gives_components()) {
    const auto& names = reducer.kind().derived_names;
    derived.names.assign(names.begin(), names.end());
  } else {
    for (const std::string& axis : calibration.sensor.instrument.axes) {
      derived.names.push_back(formatted("angle_{}_deg", axis));
    }
  }
  derived.values.resize(readings.rows(), static_cast<Eigen::Index>(derived.names.size()));
  derived.flags.assign(static_cast<std::size_t>(readings.rows()), 0);
  {
    const py::gil_scoped_release release;
    if (reducer.gives_components()) {
      derive_from_field(reducer, readings, temperatures, up, derived);
    } else {
      derive_angles_of_axes(reducer, readings, temperatures, derived);
    }
  }
  return py::make_tuple(derived.names, derived.values,
                        py::array_t<std::uint8_t>(static_cast<py::ssize_t>(derived.flags.size()),
                                                  derived.flags.data()));
}

// Makes an experiment from options of `axiscal calibrate`.
Experiment experiment_of(const std::vector<std::string>& arguments) {
  CLI::App app;
  cli::ExperimentOptions options;
  cli::OptionSet set(app, arguments, cli::Known::typed);
  cli::add_experiment_options(set, options);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    throw cli::UsageError(error.what());
  }
  return cli::make_experiment(options);
}

Calibration calibrate(const Experiment& experiment,
                      const Rows& readings,
                      const RunColumns& columns) {
  const auto axes = static_cast<Eigen::Index>(experiment.instrument.axes.size());
  if (readings.cols() != axes) {
    throw DomainError(
        formatted("readings: {} columns for an instrument with {} axes; give the names of the axes "
                  "with axes=",
                  readings.cols(), axes));
  }
  return calibrate_run(experiment, make_run(columns, readings)).front();
}

// Moves a vector into an array of NumPy without copying the numbers.
template <typename Shape>
py::array_t<double> array_of(std::vector<double>&& values, const Shape& shape) {
  auto* const owned = new std::vector<double>(std::move(values));
  const py::capsule owner(owned,
                          [](void* data) { delete static_cast<std::vector<double>*>(data); });
  return py::array_t<double>(shape, owned->data(), owner);
}

// Reads a table in any layout. A column of numbers becomes an array with NaN for empty cells. A
// column of labels or words becomes a list of texts.
// @param text  content of the table; if it is missing, the file `path` is read.
py::tuple read_table(const std::string& path, const std::optional<std::string>& text) {
  static const std::set<std::string, std::less<>> labels = {"rest",    "fence",    "serial",
                                                            "surface", "operator", "date"};
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> cells;
  RedirectedStreams streams("");
  {
    const py::gil_scoped_release release;
    const cli::OpenTable table = cli::open_table(
        path, {}, {}, CsvReader::Quotes::span_lines,
        text ? cli::reader_of(*text) : std::function<std::size_t(char*, std::size_t)>());
    names = table.csv->header();
    cells.resize(names.size());
    for (CsvReader::Row row = table.csv->next(); row != CsvReader::Row::end;
         row = table.csv->next()) {
      if (row == CsvReader::Row::defective) {
        throw DataError(path, table.csv->line(), table.csv->defect());
      }
      for (std::size_t i = 0; i < names.size(); ++i) {
        cells[i].emplace_back(table.csv->cells()[i]);
      }
    }
  }
  py::dict columns;
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::vector<double> numbers;
    if (!labels.contains(names[i])) {
      for (const std::string& cell : cells[i]) {
        const std::optional<double> number =
            cell.empty() ? std::numeric_limits<double>::quiet_NaN() : parse_number(cell);
        if (!number) {
          break;
        }
        numbers.push_back(*number);
      }
    }
    const py::str name(names[i]);
    if (!cells[i].empty() && numbers.size() == cells[i].size()) {
      columns[name] = array_of(std::move(numbers),
                               std::vector<py::ssize_t>{static_cast<py::ssize_t>(cells[i].size())});
    } else {
      columns[name] = cells[i];
    }
  }
  return py::make_tuple(columns, streams.errors);
}

struct CommandResult {
  int status = 0;
  std::string output, errors;
};

// Runs a subcommand in this process. Settings such as --quiet and --jobs apply to the whole
// process, so only one subcommand runs at a time.
CommandResult run_subcommand(const std::vector<std::string>& arguments, const std::string& input) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  static const std::vector<cli::Subcommand> subcommands = {cli::field_subcommand(),
                                                           cli::log_subcommand(),
                                                           cli::calibrate_subcommand(),
                                                           cli::segment_subcommand(),
                                                           cli::noise_subcommand(),
                                                           cli::apply_subcommand(),
                                                           cli::plan_subcommand(),
                                                           cli::simulate_subcommand(),
                                                           cli::level_subcommand(),
                                                           cli::characterize_subcommand(),
                                                           cli::check_subcommand(),
                                                           cli::budget_subcommand(),
                                                           cli::study_subcommand(),
                                                           cli::export_subcommand(&cli::run_export),
                                                           cli::import_subcommand(&cli::run_import),
                                                           cli::merge_subcommand(),
                                                           cli::template_subcommand()};
  const InputProtection no_input_is_overwritten;
  RedirectedStreams streams(input);
  const cli::Action action = cli::parse_command_line(arguments, subcommands);
  const int status = action();
  return {status, std::move(streams.output), std::move(streams.errors)};
}

// Collects all series of a recording in memory.
class SeriesCollector : public SeriesSink {
 public:
  void add(const Series& one) override {
    series.push_back(one);
    times.emplace_back();
    values.emplace_back();
  }
  void sample(std::size_t number, double time_s, std::span<const double> sample) override {
    times[number].push_back(time_s);
    values[number].insert(values[number].end(), sample.begin(), sample.end());
  }
  std::vector<Series> series;
  std::vector<std::vector<double>> times, values;
};

py::list read_log(const std::string& path) {
  SeriesCollector collector;
  std::string format;
  {
    const py::gil_scoped_release release;
    RecordingFile file(path);
    while (file.read(collector)) {
    }
    format = file.format();
  }
  py::list all;
  for (std::size_t i = 0; i < collector.series.size(); ++i) {
    const Series& series = collector.series[i];
    const auto rows = static_cast<py::ssize_t>(collector.times[i].size());
    const auto columns = static_cast<py::ssize_t>(series.columns.size());
    all.append(py::dict(
        py::arg("format") = format, py::arg("name") = series.name,
        py::arg("instance") = series.instance, py::arg("kind") = std::string(name_of(series.kind)),
        py::arg("unit") = series.unit, py::arg("columns") = series.columns,
        py::arg("time") = array_of(std::move(collector.times[i]), std::vector<py::ssize_t>{rows}),
        py::arg("values") =
            array_of(std::move(collector.values[i]), std::vector<py::ssize_t>{rows, columns})));
  }
  return all;
}

py::dict allan(const py::array_t<double, py::array::c_style | py::array::forcecast>& samples,
               double rate_hz,
               bool all_taus) {
  std::vector<AllanPoint> points;
  {
    const std::span<const double> values(samples.data(), static_cast<std::size_t>(samples.size()));
    const py::gil_scoped_release release;
    const std::vector<std::size_t> lengths =
        all_taus ? decade_lengths(values.size()) : octave_lengths(values.size());
    points = allan_deviation(values, rate_hz, lengths);
  }
  const auto column = [&](const auto& member) {
    py::array_t<double> values(static_cast<py::ssize_t>(points.size()));
    auto view = values.mutable_unchecked<1>();
    for (std::size_t i = 0; i < points.size(); ++i) {
      view(static_cast<py::ssize_t>(i)) = static_cast<double>(points[i].*member);
    }
    return values;
  };
  return py::dict(py::arg("tau") = column(&AllanPoint::tau_s),
                  py::arg("deviation") = column(&AllanPoint::deviation),
                  py::arg("low") = column(&AllanPoint::low),
                  py::arg("high") = column(&AllanPoint::high),
                  py::arg("terms") = column(&AllanPoint::terms));
}

py::tuple quantity(const Calibration& calibration, const std::string& name) {
  const Quantity one = calibration.parameter(name);
  return py::make_tuple(one.value, one.u, one.U, one.dof, one.unit);
}

std::vector<std::string> parameter_names(const Calibration& calibration) {
  std::vector<std::string> names;
  for (const ParameterUncertainty& one : parameter_uncertainties(calibration)) {
    names.push_back(one.name);
  }
  return names;
}

void bind_record(py::module_& module) {
  py::class_<RunColumns>(module, "RunColumns")
      .def(py::init<>())
      .def_readwrite("rest", &RunColumns::rest)
      .def_readwrite("fence", &RunColumns::fence)
      .def_readwrite("run", &RunColumns::run)
      .def_readwrite("block", &RunColumns::block)
      .def_readwrite("mount", &RunColumns::mount)
      .def_readwrite("level", &RunColumns::level)
      .def_readwrite("temperature", &RunColumns::temperature)
      .def_readwrite("time", &RunColumns::time)
      .def_readwrite("samples", &RunColumns::samples)
      .def_readwrite("field", &RunColumns::field);
  py::class_<Calibration>(module, "Record")
      .def_static("from_json", &parse_calibration, py::arg("text"), py::arg("path"))
      .def_static("read", &read_calibration, py::arg("path"))
      .def("json", [](const Calibration& record) { return calibration_json(record); })
      .def("summary",
           [](const Calibration& self, bool all) {
             return summary(self, all ? SummaryDetail::full : SummaryDetail::brief);
           })
      .def("report", [](const Calibration& self) { return calibration_report(self, {}); })
      .def("quantity", &quantity)
      .def("parameter_names", &parameter_names)
      .def("write", [](const Calibration& self, const std::string& path,
                       bool force) { write(self, path, force ? Force::yes : Force::no); })
      .def("apply", &apply, py::call_guard<py::gil_scoped_release>())
      .def("derived", &derived)
      .def_property_readonly("bias",
                             [](const Calibration& self) { return self.sensor.response.bias; })
      .def_property_readonly(
          "sensitivity", [](const Calibration& self) { return self.sensor.response.sensitivity; })
      .def_property_readonly("covariance",
                             [](const Calibration& self) { return parameter_covariance(self); })
      .def_property_readonly("unit",
                             [](const Calibration& self) { return self.sensor.instrument.unit; })
      .def_property_readonly("field_unit",
                             [](const Calibration& self) { return self.sensor.field.unit; })
      .def_property_readonly("kind",
                             [](const Calibration& self) { return self.sensor.instrument.kind; })
      .def_property_readonly("serial",
                             [](const Calibration& self) { return self.sensor.instrument.serial; })
      .def_property_readonly(
          "has_temperature",
          [](const Calibration& self) { return self.sensor.temperature.has_value(); })
      .def_property_readonly("axes",
                             [](const Calibration& self) { return self.sensor.instrument.axes; })
      .def_property_readonly("created",
                             [](const Calibration& self) { return self.provenance.created; })
      .def_property_readonly("measured",
                             [](const Calibration& self) { return self.provenance.measured; })
      .def_property_readonly(
          "status", [](const Calibration& self) { return std::string(status_name(self.status())); })
      .def_property_readonly("warnings",
                             [](const Calibration& self) {
                               py::list all;
                               for (const CalibrationWarning& one : self.findings.warnings) {
                                 all.append(py::make_tuple(std::string(warning_name(one.code)),
                                                           one.message, one.runs));
                               }
                               return all;
                             })
      .def_property_readonly("notes", [](const Calibration& self) {
        py::list all;
        for (const CalibrationNote& one : self.findings.notes) {
          all.append(py::make_tuple(std::string(note_name(one.code)), one.message));
        }
        return all;
      });
}

// Raises an exception whose class has the same name as in C++. The message names the command-line
// options, like the messages of the command `axiscal`.
void raise(const py::object& type, const Error& error) {
  py::object exception = type(cli::with_options(error));
  if (const auto* const rank = dynamic_cast<const RankDeficientError*>(&error)) {
    exception.attr("undetermined") = rank->undetermined();
  }
  PyErr_SetObject(type.ptr(), exception.ptr());
}

void bind_errors() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    if (!thrown) {
      return;
    }
    const auto type = [](const char* name) {
      return py::module_::import("axiscal.errors").attr(name).cast<py::object>();
    };
    try {
      std::rethrow_exception(thrown);
    } catch (const RankDeficientError& error) {
      raise(type("RankDeficientError"), error);
    } catch (const RefusedError& error) {
      raise(type("RefusedError"), error);
    } catch (const SetupError& error) {
      raise(type("SetupError"), error);
    } catch (const cli::UsageError& error) {
      raise(type("SetupError"), error);
    } catch (const DomainError& error) {
      raise(type("DomainError"), error);
    } catch (const DataError& error) {
      raise(type("DataError"), error);
    } catch (const InputOverwriteError& error) {
      raise(type("OutputError"), error);
    } catch (const OutputError& error) {
      raise(type("OutputError"), error);
    } catch (const Error& error) {
      raise(type("Error"), error);
    }
  });
}

}  // namespace
}  // namespace axiscal::python

PYBIND11_MODULE(_axiscal, module) {
  using namespace axiscal;
  add_formula_field();
  module.attr("version") = std::string(software_name());
  python::bind_errors();
  python::bind_record(module);
  py::class_<Experiment>(module, "Experiment");
  module.def("experiment", &python::experiment_of);
  module.def("read_table", &python::read_table, py::arg("path"), py::arg("text") = py::none());
  module.def("calibrate", &python::calibrate, py::call_guard<py::gil_scoped_release>());
  module.def(
      "run_subcommand",
      [](const std::vector<std::string>& arguments, const std::string& input) {
        python::CommandResult result;
        {
          const py::gil_scoped_release release;
          result = python::run_subcommand(arguments, input);
        }
        return py::make_tuple(result.status, py::bytes(result.output), result.errors);
      },
      py::arg("arguments"), py::arg("input") = "");
  module.def("read_log", &python::read_log);
  module.def("allan", &python::allan);
  module.def("rounded", [](double value, double u) {
    return py::make_tuple(rounded_value(value, u), rounded_uncertainty(u));
  });
}
