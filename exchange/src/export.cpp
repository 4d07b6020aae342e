// SPDX-License-Identifier: Apache-2.0
#include "axiscal/exchange/export.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/exchange/settings.hpp"
#include "core/formatted.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

using Writer = Exported (*)(const Calibration&, const ExportOptions&);

// An export format and the function that writes it. The table below is sorted by name.
struct KnownExport {
  ExportFormat format;
  Writer write;
};

constexpr std::array known_exports = {
    KnownExport{
        ExportFormat{
            "ardupilot", "ArduPilot parameters (.param): INS_ACC*, INS_GYR*, COMPASS_*",
            "accelerometer (v - INS_ACCOFFS) * INS_ACCSCAL; gyroscope v - INS_GYROFFS; compass M "
            "(v + COMPASS_OFS), with M from COMPASS_DIA and COMPASS_ODI"},
        export_ardupilot},
    KnownExport{
        ExportFormat{"betaflight", "Betaflight's command line: acc_calibration, mag_calibration",
                     "v - calibration, in counts"},
        export_betaflight},
    KnownExport{ExportFormat{"c-header",
                             "C99: coefficients and a function that applies them, with temperature",
                             "inverse ((v - bias(t)) / scale(t))"},
                export_c_header},
    KnownExport{ExportFormat{"cpp-header",
                             "C++17 (constexpr): coefficients and function as in "
                             "c-header",
                             "inverse ((v - bias(t)) / scale(t))"},
                export_cpp_header},
    KnownExport{ExportFormat{"csv", "a table: every coefficient with u, U and unit",
                             "v = bias(t) + scale(t) S f"},
                export_csv},
#ifdef AXISCAL_PUGIXML
    KnownExport{
        ExportFormat{
            "dcc",
            "Digital Calibration Certificate (PTB's XML schema 3), with the laboratory's details",
            "v = bias(t) + scale(t) S f"},
        export_dcc},
#endif
    KnownExport{ExportFormat{"iio", "Linux IIO (shell): in_accel_x_calibbias, .._calibscale, ...",
                             "calibscale (v + calibbias)"},
                export_iio},
    KnownExport{ExportFormat{"kalibr", "Kalibr's imu.yaml, model scale-misalignment: M, C, A",
                             "v = M C f + bias; gyroscope v = M C w + A C a + bias"},
                export_kalibr},
#ifdef AXISCAL_QRENCODE
    KnownExport{ExportFormat{"label",
                             "a label (SVG): serial number, date, and a QR code of serial "
                             "number and digest",
                             "v = bias(t) + scale(t) S f"},
                export_label},
#endif
    KnownExport{
        ExportFormat{"matlab", "MATLAB (.mat, v5): bias, sensitivity, inverse, covariance, ...",
                     "v = bias(t) + scale(t) S f", false},
        export_matlab},
#ifdef AXISCAL_MINIZIP
    KnownExport{ExportFormat{"numpy", "NumPy (.npz): bias, sensitivity, inverse, covariance, ...",
                             "v = bias(t) + scale(t) S f", false},
                export_numpy},
#endif
    KnownExport{ExportFormat{"openhtf", "OpenHTF test record (JSON): outcome, measurements, limits",
                             "v = bias(t) + scale(t) S f"},
                export_openhtf},
    KnownExport{
        ExportFormat{
            "px4", "PX4 parameters (.params): CAL_ACC*, CAL_GYRO*, CAL_MAG*",
            "accelerometer (v - OFF) * SCALE; gyroscope v - OFF; magnetometer M (v - OFF), with M "
            "from SCALE and ODIAG"},
        export_px4},
    KnownExport{ExportFormat{"ros", "ROS imu_calib (YAML): SM, bias", "SM v - bias"}, export_ros},
    KnownExport{ExportFormat{"tofupilot", "TofuPilot run (JSON): unit under test, steps, limits",
                             "v = bias(t) + scale(t) S f"},
                export_tofupilot},
    KnownExport{ExportFormat{
                    "x-io", "x-IMU3 and x-io's Fusion (JSON): misalignment, sensitivity, offset",
                    "misalignment diag(sensitivity) (v - offset); magnetometer softIronMatrix (v - "
                    "hardIronOffset)"},
                export_x_io},
#ifdef AXISCAL_XLSXWRITER
    KnownExport{ExportFormat{"xlsx",
                             "a spreadsheet: coefficients, and live formulas that correct readings "
                             "and give angles",
                             "inverse ((v - bias(t)) / scale(t))", false},
                export_xlsx},
#endif
};

void require_identifier(const std::string& name) {
  const bool starts =
      !name.empty() && (std::isalpha(static_cast<unsigned char>(name[0])) != 0 || name[0] == '_');
  const bool goes_on = std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  });
  constexpr std::array<std::string_view, 36> taken = {
      "auto",   "bool",   "break", "case",   "catch",  "char",      "class", "const",  "delete",
      "double", "else",   "enum",  "export", "extern", "false",     "float", "for",    "friend",
      "if",     "inline", "int",   "long",   "main",   "namespace", "new",   "public", "return",
      "short",  "signed", "std",   "struct", "this",   "true",      "union", "void",   "while"};
  if (!starts || !goes_on || std::find(taken.begin(), taken.end(), name) != taken.end()) {
    throw DomainError(
        formatted("'{}' is not a valid name for a header: use letters, digits and _, but not a "
                  "keyword of C++",
                  name));
  }
}

// Writes a record. If a conversion from g to m/s^2 needs the local gravity and the record does not
// state it, standard gravity is used. Drivers assume standard gravity too.
// @param write  function that writes the file with the given options.
template <typename Write>
Exported with_gravity(const ExportOptions& options, const Write& write) {
  try {
    return write(options);
  } catch (const RefusedError& error) {
    const std::vector<Setting>& mends = error.settings();
    if (options.local_gravity ||
        std::find(mends.begin(), mends.end(), settings::local_gravity) == mends.end()) {
      throw;
    }
  }
  ExportOptions by_standard = options;
  by_standard.local_gravity = standard_gravity;
  Exported exported = write(by_standard);
  exported.notes.push_back(
      formatted("1 g is taken as standard gravity, {} m/s^2, because the record does not state "
                "local gravity; local gravity differs from this value by up to 0.3 %",
                number_text(standard_gravity)));
  if (exported.content.starts_with("# ")) {  // the file can contain comments
    exported.content.insert(0, "# " + exported.notes.back() + "\n");
  }
  return exported;
}

void check_options(const ExportOptions& options) {
  if (!options.name.empty()) {
    require_identifier(options.name);
  }
  if (options.instance < 0 || options.instance > 9) {
    throw DomainError("the number of a sensor must be 0 to 9");
  }
  if (options.reading_factor &&
      !(std::isfinite(*options.reading_factor) && *options.reading_factor != 0.0)) {
    throw DomainError("the reading factor must be a number other than 0");
  }
}

const KnownExport& find_export(std::string_view format) {
  std::vector<std::string_view> names;
  for (const KnownExport& one : known_exports) {
    if (one.format.name == format) {
      return one;
    }
    names.push_back(one.format.name);
  }
  throw DomainError(formatted("unknown format '{}'{}", format, did_you_mean(format, names)));
}

}  // namespace

std::span<const ExportFormat> export_formats() {
  static const std::vector<ExportFormat> all = [] {
    std::vector<ExportFormat> formats;
    std::transform(known_exports.begin(), known_exports.end(), std::back_inserter(formats),
                   [](const KnownExport& one) { return one.format; });
    return formats;
  }();
  return all;
}

HeaderNumbers parse_header_numbers(std::string_view text) {
  HeaderNumbers numbers;
  if (text == "double") {
    return numbers;
  }
  if (text == "float") {
    numbers.type = HeaderNumbers::Type::float32;
    return numbers;
  }
  if (text.starts_with('q')) {
    const std::vector<std::string_view> parts = split(text.substr(1), ':');
    const std::optional<int> first = parse_integer(parts.front());
    const std::optional<int> last = parse_integer(parts.back());
    if (parts.size() <= 2 && first && last && *first >= 0 && *first <= 24 && *last >= 0 &&
        *last <= 28) {
      return {.type = HeaderNumbers::Type::fixed, .reading_bits = *first, .field_bits = *last};
    }
  }
  throw DomainError(
      formatted("'{}' is not a number type: use double, float, q16 (16 binary places; up to q24), "
                "or q0:16 (0 binary places of the readings, 16 of the field)",
                text));
}

Exported export_calibration(const Calibration& calibration,
                            std::string_view format,
                            const ExportOptions& options) {
  check_options(options);
  const KnownExport& known = find_export(format);
  return with_gravity(options,
                      [&](const ExportOptions& own) { return known.write(calibration, own); });
}

Exported export_vehicle(const std::vector<const Calibration*>& calibrations,
                        std::string_view format,
                        const ExportOptions& options) {
  check_options(options);
  const KnownExport& known = find_export(format);
  if (known.write != export_px4 && known.write != export_ardupilot && known.write != export_iio) {
    throw RefusedError(formatted("format {} allows only one instrument per file", format));
  }
  Exported all;
  for (const Calibration* calibration : calibrations) {
    ExportOptions own = options;
    own.instance = 0;  // 0 makes the writer use the instance in the record
    Exported one = export_calibration(*calibration, format, own);
    all.content += (all.content.empty() ? "" : "\n") + one.content;
    all.notes.insert(all.notes.end(), one.notes.begin(), one.notes.end());
    if (one.loss && (!all.loss || one.loss->worst_deg > all.loss->worst_deg)) {
      all.loss = one.loss;
    }
  }
  return all;
}

Exported export_imu(const Calibration& first,
                    const Calibration& second,
                    std::string_view format,
                    const ExportOptions& options) {
  check_options(options);
  if (find_export(format).write != export_kalibr) {
    return export_vehicle({&first, &second}, format, options);
  }
  return with_gravity(
      options, [&](const ExportOptions& own) { return export_kalibr_imu(first, second, own); });
}

}  // namespace axiscal
