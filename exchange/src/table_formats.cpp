// SPDX-License-Identifier: Apache-2.0
// Formats csv, matlab and numpy: files with all coefficients of any instrument.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>

#include <Eigen/LU>
#include <Eigen/QR>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/printable_text.hpp"
#include "core/formatted.hpp"
#include "core/npy_header.hpp"
#include "core/temporary_file.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

#ifdef AXISCAL_MINIZIP
#include <minizip/zip.h>
#endif

namespace axiscal {
namespace {

CombinedUncertainty unknown_uncertainty() {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  CombinedUncertainty uncertainty;
  uncertainty.u = uncertainty.expanded = uncertainty.coverage_factor = unknown;
  return uncertainty;
}

struct Coefficient {
  std::string name;
  double value;
  double standard_error;  // NaN: unknown
};

double at_or_nan(const Eigen::VectorXd& values, Eigen::Index k) {
  return k < values.size() ? values(k) : std::nan("");
}

std::vector<Coefficient> coefficients_of(const Calibration& calibration) {
  std::vector<Coefficient> all;
  const Instrument& instrument = calibration.sensor.instrument;
  const Eigen::VectorXd bias_se =
      calibration.fit.statistics ? calibration.fit.statistics->bias_se : Eigen::VectorXd();
  for (Eigen::Index k = 0; k < instrument.axis_count(); ++k) {
    const std::string axis = instrument.axes[static_cast<std::size_t>(k)];
    all.push_back({axis + ".bias", calibration.sensor.response.bias(k), at_or_nan(bias_se, k)});
    for (int j = 0; j < 3; ++j) {
      const bool has_se =
          calibration.fit.statistics && calibration.fit.statistics->sensitivity_se.rows() > k;
      all.push_back({formatted("{}.sensitivity.{}", axis, "xyz"[j]),
                     calibration.sensor.response.sensitivity(k, j),
                     has_se ? calibration.fit.statistics->sensitivity_se(k, j) : std::nan("")});
    }
    if (!calibration.sensor.temperature) {
      continue;
    }
    const TemperatureResponse& over = *calibration.sensor.temperature;
    for (const bool is_bias : {true, false}) {
      const Eigen::MatrixXd& values = is_bias ? over.bias : over.scale;
      const Eigen::MatrixXd& errors = is_bias ? over.bias_se : over.scale_se;
      for (Eigen::Index i = 0; i < values.cols(); ++i) {
        const std::string power = i == 0 ? "d" : formatted("d{}", i + 1);
        all.push_back({axis + (is_bias ? ".bias." : ".scale.") + power, values(k, i),
                       errors.rows() > k && errors.cols() > i ? errors(k, i) : std::nan("")});
      }
    }
  }
  return all;
}

// A named array in a MATLAB or NumPy file.
struct NamedArray {
  std::string name;
  Eigen::MatrixXd values;
};

std::vector<NamedArray> arrays_of(const Calibration& calibration) {
  std::vector<NamedArray> all = {
      {"bias", calibration.sensor.response.bias},
      {"sensitivity", calibration.sensor.response.sensitivity},
      {"field_magnitude", Eigen::MatrixXd::Constant(1, 1, calibration.sensor.field.magnitude)}};
  if (calibration.sensor.instrument.axis_count() == 3 && !calibration.sensor.instrument.one_sided) {
    const Eigen::Matrix3d S = calibration.sensor.response.sensitivity;
    all.push_back({"inverse", S.inverse()});
  }
  if (calibration.sensor.temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    const auto sensors = static_cast<Eigen::Index>(over.spans.size());
    Eigen::MatrixXd reference(sensors, 1);
    Eigen::MatrixXd range(sensors, 2);
    for (Eigen::Index s = 0; s < sensors; ++s) {
      const TemperatureSpan& span = over.spans[static_cast<std::size_t>(s)];
      reference(s, 0) = span.reference;
      range.row(s) << span.low, span.high;
    }
    all.push_back({"temperature_reference", reference});
    all.push_back({"temperature_range", range});
    all.push_back({"temperature_bias", over.bias});
    all.push_back({"temperature_scale", over.scale});
  }
  if (calibration.fit.statistics) {
    all.push_back({"covariance", calibration.fit.statistics->covariance});
    all.push_back({"residual_sd", calibration.fit.statistics->residual_sd});
    all.push_back({"degrees_of_freedom", calibration.fit.statistics->degrees_of_freedom});
    // This matrix has one row per parameter, in the order of parameter_names.
    const std::vector<ParameterUncertainty> uncertainties = parameter_uncertainties(calibration);
    Eigen::MatrixXd columns(static_cast<Eigen::Index>(uncertainties.size()), 4);
    for (std::size_t i = 0; i < uncertainties.size(); ++i) {
      const CombinedUncertainty& one = uncertainties[i].uncertainty;
      columns.row(static_cast<Eigen::Index>(i)) << uncertainties[i].value, one.u, one.expanded,
          one.coverage_factor;
    }
    all.push_back({"parameter_value", columns.col(0)});
    all.push_back({"standard_uncertainty", columns.col(1)});
    all.push_back({"expanded_uncertainty", columns.col(2)});
    all.push_back({"coverage_factor", columns.col(3)});
  }
  return all;
}

std::vector<std::pair<std::string, std::string>> texts_of(const Calibration& calibration) {
  return {
      {"kind", calibration.sensor.instrument.kind},
      {"serial", calibration.sensor.instrument.serial},
      {"axes", joined(calibration.sensor.instrument.axes, ",")},
      {"unit", calibration.sensor.instrument.unit},
      {"field_unit", calibration.sensor.field.unit},
      {"status", std::string(status_name(calibration.findings.status))},
      {"created", calibration.provenance.created},
      {"measured", calibration.provenance.measured},
      {"software", calibration.provenance.software},
      {"formula", "v = bias(t) + scale(t) S f, field f in the instrument's frame"},
      {"parameter_names",
       calibration.fit.statistics ? joined(calibration.fit.statistics->parameter_names, ",") : ""}};
}

// Returns an element of a MAT-file of version 5 ("MAT-File Format", MathWorks). It consists of
// type, size and bytes, padded with zeros to a multiple of 8 bytes.
std::string mat_element(std::uint32_t type, std::string_view bytes) {
  const std::array<std::uint32_t, 2> tag = {type, static_cast<std::uint32_t>(bytes.size())};
  std::string element(reinterpret_cast<const char*>(tag.data()), sizeof tag);
  element += bytes;
  constexpr std::size_t boundary = 8;
  element.resize((element.size() + boundary - 1) / boundary * boundary, '\0');
  return element;
}

template <typename Number>
std::string_view bytes_of(const Number* numbers, std::size_t count) {
  return {reinterpret_cast<const char*>(numbers), count * sizeof(Number)};
}

// Returns a variable of a MAT-file.
// @param values  the MAT element with the numbers or characters.
std::string mat_variable(const std::string& name,
                         std::uint32_t array_class,
                         std::array<std::int32_t, 2> size,
                         const std::string& values) {
  enum : std::uint32_t { int8_type = 1, int32_type = 5, uint32_type = 6, matrix_type = 14 };
  const std::array<std::uint32_t, 2> flags = {array_class, 0};
  return mat_element(matrix_type, mat_element(uint32_type, bytes_of(flags.data(), flags.size())) +
                                      mat_element(int32_type, bytes_of(size.data(), size.size())) +
                                      mat_element(int8_type, name) + values);
}

#ifdef AXISCAL_MINIZIP
std::string npy_of(const Eigen::MatrixXd& values) {
  const std::string rows = std::to_string(values.rows());
  std::string text = values.cols() == 1
                         ? npy_header("'<f8'", formatted("({},)", rows))
                         : npy_header("'<f8'", formatted("({}, {})", rows, values.cols()), true);
  const std::size_t start = text.size();
  const std::size_t bytes = static_cast<std::size_t>(values.size()) * sizeof(double);
  text.resize(start + bytes);
  std::memcpy(text.data() + start, values.data(), bytes);
  return text;
}

std::string npy_of(const std::string& value) {
  const std::string text = value.empty() ? std::string(1, '\0') : value;
  return npy_header(formatted("'|S{}'", text.size()), "()") + text;
}

struct CloseZip {
  void operator()(void* zip) const { zipClose(zip, nullptr); }
};

void add_entry(void* zip, const std::string& name, const std::string& content) {
  zip_fileinfo info{};
  info.dosDate = 0x210000;  // constant date 1980-01-01, so that equal calibrations give equal bytes
  const bool is_open = zipOpenNewFileInZip(zip, name.c_str(), &info, nullptr, 0, nullptr, 0,
                                           nullptr, 0, 0) == ZIP_OK;
  if (!is_open ||
      zipWriteInFileInZip(zip, content.data(), static_cast<unsigned>(content.size())) != ZIP_OK ||
      zipCloseFileInZip(zip) != ZIP_OK) {
    throw OutputError("numpy: the archive cannot be written");
  }
}
#endif

}  // namespace

Exported export_csv(const Calibration& calibration, const ExportOptions&) {
  std::vector<std::string> lines = {formatted("v = bias + sensitivity f; field f in {}, v in {}",
                                              calibration.sensor.field.unit,
                                              calibration.sensor.instrument.unit)};
  if (calibration.sensor.temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    lines.push_back(formatted(
        "bias(t) = bias + bias.d d + ..., scale(t) = 1 + scale.d d + ..., d = "
        "temperature - {}; v = bias(t) + scale(t) sensitivity f",
        span_text(over, calibration.sensor.instrument.axes,
                  [](const TemperatureSpan& span) { return number_text(span.reference); })));
  }
  std::string text = comment_lines(calibration, "# ", lines, std::nullopt);
  text += "parameter,value,standard_error,u,U,k,unit\n";
  const std::vector<ParameterUncertainty> uncertainties = parameter_uncertainties(calibration);
  const auto or_empty = [](double number) {
    return std::isfinite(number) ? number_text(number) : std::string();
  };
  for (const Coefficient& one : coefficients_of(calibration)) {
    const auto known =
        std::find_if(uncertainties.begin(), uncertainties.end(),
                     [&](const ParameterUncertainty& other) { return other.name == one.name; });
    const CombinedUncertainty all =
        known != uncertainties.end() ? known->uncertainty : unknown_uncertainty();
    text += formatted("{},{},{},{},{},{},{}\n", formula_safe_cell(one.name), number_text(one.value),
                      or_empty(one.standard_error), or_empty(all.u), or_empty(all.expanded),
                      or_empty(all.coverage_factor),
                      formula_safe_cell(parameter_unit(calibration, one.name)));
  }
  return {.content = text, .loss = std::nullopt};
}

Exported export_matlab(const Calibration& calibration, const ExportOptions&) {
  enum : std::uint32_t { char_class = 4, double_class = 6, double_type = 9, utf8_type = 16 };
  constexpr std::size_t text_size = 124;  // number of bytes before the version
  std::string content = "MATLAB 5.0 MAT-file, by axiscal";
  content.resize(text_size, ' ');
  const std::array<std::uint16_t, 2> version_and_order = {0x0100, 0x4d49};
  content += bytes_of(version_and_order.data(), version_and_order.size());
  for (const NamedArray& array : arrays_of(calibration)) {
    const Eigen::MatrixXd& values = array.values;
    content += mat_variable(
        array.name, double_class,
        {static_cast<std::int32_t>(values.rows()), static_cast<std::int32_t>(values.cols())},
        mat_element(double_type, bytes_of(values.data(), static_cast<std::size_t>(values.size()))));
  }
  for (const auto& [name, text] : texts_of(calibration)) {
    content += mat_variable(name, char_class, {1, static_cast<std::int32_t>(text.size())},
                            mat_element(utf8_type, text));
  }
  return {.content = content, .loss = std::nullopt};
}

#ifdef AXISCAL_MINIZIP
Exported export_numpy(const Calibration& calibration, const ExportOptions&) {
  const TemporaryFile temporary;
  std::unique_ptr<void, CloseZip> zip(zipOpen64(temporary.path().c_str(), APPEND_STATUS_CREATE));
  if (!zip) {
    throw OutputError(temporary.path() + ": cannot be written");
  }
  for (const NamedArray& array : arrays_of(calibration)) {
    add_entry(zip.get(), array.name + ".npy", npy_of(array.values));
  }
  for (const auto& [name, text] : texts_of(calibration)) {
    add_entry(zip.get(), name + ".npy", npy_of(text));
  }
  if (zipClose(zip.release(), nullptr) != ZIP_OK) {
    throw OutputError(temporary.path() + ": cannot be written");
  }
  return {.content = read_whole_file(temporary.path()), .loss = std::nullopt};
}
#endif

}  // namespace axiscal
