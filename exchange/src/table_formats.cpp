// SPDX-License-Identifier: Apache-2.0
// csv, matlab, numpy: all of the coefficients, for any instrument.
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
#include "axiscal/core/shown_text.hpp"
#include "core/formatted.hpp"
#include "core/late_library.hpp"
#include "core/npy_header.hpp"
#include "core/temporary_file.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

#ifdef AXISCAL_MATIO
#include <matio.h>

#include <unistd.h>
#endif
#ifdef AXISCAL_LIBARCHIVE
#include <archive.h>
#include <archive_entry.h>
#endif

namespace axiscal {
namespace {

#ifdef AXISCAL_MATIO_LATE
AXISCAL_LATE_LIBRARY(libmatio, AXISCAL_MATIO)
AXISCAL_LATE(libmatio, Mat_Close)
AXISCAL_LATE(libmatio, Mat_CreateVer)
AXISCAL_LATE(libmatio, Mat_VarCreate)
AXISCAL_LATE(libmatio, Mat_VarFree)
AXISCAL_LATE(libmatio, Mat_VarWrite)
#endif

#ifdef AXISCAL_LIBARCHIVE_LATE
AXISCAL_LATE_LIBRARY(libarchive, AXISCAL_LIBARCHIVE)
AXISCAL_LATE(libarchive, archive_entry_free)
AXISCAL_LATE(libarchive, archive_entry_new)
AXISCAL_LATE(libarchive, archive_entry_set_filetype)
AXISCAL_LATE(libarchive, archive_entry_set_mtime)
AXISCAL_LATE(libarchive, archive_entry_set_pathname)
AXISCAL_LATE(libarchive, archive_entry_set_perm)
AXISCAL_LATE(libarchive, archive_entry_set_size)
AXISCAL_LATE(libarchive, archive_error_string)
AXISCAL_LATE(libarchive, archive_write_close)
AXISCAL_LATE(libarchive, archive_write_data)
AXISCAL_LATE(libarchive, archive_write_free)
AXISCAL_LATE(libarchive, archive_write_header)
AXISCAL_LATE(libarchive, archive_write_new)
AXISCAL_LATE(libarchive, archive_write_open)
AXISCAL_LATE(libarchive, archive_write_set_bytes_in_last_block)
AXISCAL_LATE(libarchive, archive_write_set_format_zip)
AXISCAL_LATE(libarchive, archive_write_zip_set_compression_store)
#endif

CombinedUncertainty unknown_uncertainty() {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  CombinedUncertainty uncertainty;
  uncertainty.u = uncertainty.expanded = uncertainty.coverage_factor = unknown;
  return uncertainty;
}

struct Coefficient {
  std::string name;
  double value;
  double standard_error;  // NaN: not known
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

// The arrays that matlab and numpy get, by name.
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
    // One for each of parameter_names.
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

#ifdef AXISCAL_MATIO
void add_variable(mat_t* file, matvar_t* variable) {
  const std::unique_ptr<matvar_t, void (*)(matvar_t*)> owned(variable, Mat_VarFree);
  if (!owned || Mat_VarWrite(file, owned.get(), MAT_COMPRESSION_NONE) != 0) {
    throw OutputError("matlab: a variable cannot be written");
  }
}
#endif

#ifdef AXISCAL_LIBARCHIVE
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

void add_entry(archive* zip, const std::string& name, const std::string& content) {
  const std::unique_ptr<archive_entry, void (*)(archive_entry*)> entry(archive_entry_new(),
                                                                       archive_entry_free);
  archive_entry_set_pathname(entry.get(), name.c_str());
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(content.size()));
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), 0644);
  constexpr std::int64_t zip_epoch = 315532800;  // 1980-01-01: the same bytes each time
  archive_entry_set_mtime(entry.get(), zip_epoch, 0);
  if (archive_write_header(zip, entry.get()) != ARCHIVE_OK ||
      archive_write_data(zip, content.data(), content.size()) !=
          static_cast<la_ssize_t>(content.size())) {
    throw OutputError(std::string("numpy: ") + archive_error_string(zip));
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
    text += formatted("{},{},{},{},{},{},{}\n", harmless_cell(one.name), number_text(one.value),
                      or_empty(one.standard_error), or_empty(all.u), or_empty(all.expanded),
                      or_empty(all.coverage_factor),
                      harmless_cell(parameter_unit(calibration, one.name)));
  }
  return {.content = text, .loss = std::nullopt};
}

#ifdef AXISCAL_MATIO
Exported export_matlab(const Calibration& calibration, const ExportOptions&) {
  const TemporaryFile temporary;
  {
    const std::unique_ptr<mat_t, int (*)(mat_t*)> file(
        Mat_CreateVer(temporary.path().c_str(), "MATLAB 5.0 MAT-file, by axiscal", MAT_FT_MAT5),
        Mat_Close);
    if (!file) {
      throw OutputError(temporary.path() + ": cannot be written");
    }
    for (const NamedArray& array : arrays_of(calibration)) {
      std::array<std::size_t, 2> size = {static_cast<std::size_t>(array.values.rows()),
                                         static_cast<std::size_t>(array.values.cols())};
      Eigen::MatrixXd values = array.values;
      add_variable(file.get(), Mat_VarCreate(array.name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2,
                                             size.data(), values.data(), 0));
    }
    for (auto& [name, text] : texts_of(calibration)) {
      std::array<std::size_t, 2> size = {1, text.size()};
      std::string value = text;
      add_variable(file.get(), Mat_VarCreate(name.c_str(), MAT_C_CHAR, MAT_T_UTF8, 2, size.data(),
                                             value.data(), 0));
    }
  }
  return {.content = read_whole_file(temporary.path()), .loss = std::nullopt};
}
#endif

#ifdef AXISCAL_LIBARCHIVE
Exported export_numpy(const Calibration& calibration, const ExportOptions&) {
  const std::unique_ptr<archive, int (*)(archive*)> zip(archive_write_new(), archive_write_free);
  std::string content;
  archive_write_set_format_zip(zip.get());
  archive_write_zip_set_compression_store(zip.get());
  archive_write_set_bytes_in_last_block(zip.get(), 1);
  const auto append = [](archive*, void* to, const void* data, std::size_t size) -> la_ssize_t {
    static_cast<std::string*>(to)->append(static_cast<const char*>(data), size);
    return static_cast<la_ssize_t>(size);
  };
  if (archive_write_open(zip.get(), &content, nullptr, append, nullptr) != ARCHIVE_OK) {
    throw OutputError(std::string("numpy: ") + archive_error_string(zip.get()));
  }
  for (const NamedArray& array : arrays_of(calibration)) {
    add_entry(zip.get(), array.name + ".npy", npy_of(array.values));
  }
  for (const auto& [name, text] : texts_of(calibration)) {
    add_entry(zip.get(), name + ".npy", npy_of(text));
  }
  if (archive_write_close(zip.get()) != ARCHIVE_OK) {
    throw OutputError(std::string("numpy: ") + archive_error_string(zip.get()));
  }
  return {.content = content, .loss = std::nullopt};
}
#endif

}  // namespace axiscal
