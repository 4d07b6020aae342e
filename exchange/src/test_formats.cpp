// SPDX-License-Identifier: Apache-2.0
// Formats openhtf, tofupilot and label: results for test benches, and a label to print.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#ifdef AXISCAL_QRENCODE
#include <memory>
#include <qrencode.h>
#endif

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/calib/verdict.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "core/formatted.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

using Json = nlohmann::ordered_json;

// A measured quantity, with limits if any are stated.
struct Measurement {
  std::string name, unit;
  double value = 0.0;
  double expanded = 0.0;  // NaN if unknown
  std::optional<double> low, high;
  bool passed = true;
};

bool has_passed(const Calibration& calibration) {
  return calibration.findings.verdict ? calibration.findings.verdict->passed
                                      : calibration.findings.status != CalibrationStatus::refused;
}

// Returns first the verdict's quantities, with their limits, and then the parameters, without
// limits.
std::vector<Measurement> measurements_of(const Calibration& calibration) {
  std::vector<Measurement> all;
  const std::vector<ParameterUncertainty> parameters = parameter_uncertainties(calibration);
  const auto has = [&](const std::string& name) {
    return std::any_of(all.begin(), all.end(),
                       [&](const Measurement& one) { return one.name == name; });
  };
  if (calibration.findings.verdict) {
    for (const LimitVerdict& limit : calibration.findings.verdict->limits) {
      all.push_back({.name = limit.parameter,
                     .unit = {},
                     .value = limit.value,
                     .expanded = not_a_number,
                     .low = limit.low,
                     .high = limit.high,
                     .passed = limit.passed});
    }
  }
  for (const ParameterUncertainty& parameter : parameters) {
    if (!has(parameter.name)) {
      all.push_back({.name = parameter.name,
                     .unit = {},
                     .value = parameter.value,
                     .expanded = not_a_number,
                     .low = {},
                     .high = {}});
    }
  }
  for (Measurement& one : all) {
    for (const ParameterUncertainty& parameter : parameters) {
      if (parameter.name == one.name) {
        one.unit = parameter_unit(calibration, one.name);
        one.expanded = parameter.uncertainty.expanded;
      }
    }
  }
  return all;
}

Json number_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json limit_or_null(const std::optional<double>& limit) {
  return limit ? Json(*limit) : Json(nullptr);
}

std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

// Writes the JSON that OpenHTF's openhtf.output.callbacks.json_factory would write.
Exported export_openhtf(const Calibration& calibration, const ExportOptions& /*options*/) {
  const Instrument& instrument = calibration.sensor.instrument;
  const char* const outcome = has_passed(calibration) ? "PASS" : "FAIL";
  const double seconds = parse_date(calibration.provenance.date()).value_or(0.0);
  const auto millis = static_cast<std::int64_t>(1000.0 * seconds);
  Json measurements = Json::object();
  for (const Measurement& one : measurements_of(calibration)) {
    Json json{{"name", one.name},
              {"outcome", one.passed ? "PASS" : "FAIL"},
              {"measured_value", number_or_null(one.value)},
              {"units", {one.unit, nullptr, one.unit}}};
    if (std::isfinite(one.expanded)) {
      json["docstring"] =
          formatted("expanded uncertainty U (95 %) {}", number_text(one.expanded, 3));
    }
    if (one.low || one.high) {
      json["validators"] = {one.low && one.high ? formatted("{} <= x <= {}", number_text(*one.low),
                                                            number_text(*one.high))
                            : one.low           ? formatted("{} <= x", number_text(*one.low))
                                                : formatted("x <= {}", number_text(*one.high))};
    }
    measurements[one.name] = std::move(json);
  }
  Json details = Json::array();
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    details.push_back({{"code", warning_name(warning.code)}, {"description", warning.message}});
  }
  const Json phase{
      {"name", "calibration"},        {"codeinfo", {{"name", calibration.provenance.software}}},
      {"start_time_millis", millis},  {"end_time_millis", millis},
      {"outcome", outcome},           {"measurements", std::move(measurements)},
      {"attachments", Json::object()}};
  return {.content = text_of(Json{{"dut_id", instrument.serial},
                                  {"station_id", calibration.provenance.positioner},
                                  {"start_time_millis", millis},
                                  {"end_time_millis", millis},
                                  {"outcome", outcome},
                                  {"outcome_details", std::move(details)},
                                  {"metadata",
                                   {{"test_name", "axiscal calibrate"},
                                    {"test_version", calibration.provenance.software},
                                    {"part_number", instrument.model},
                                    {"operator", calibration.provenance.operated_by},
                                    {"kind", instrument.kind}}},
                                  {"phases", {phase}},
                                  {"log_records", Json::array()}}),
          .loss = {},
          .notes = {}};
}

Exported export_tofupilot(const Calibration& calibration, const ExportOptions& /*options*/) {
  const Instrument& instrument = calibration.sensor.instrument;
  Json steps = Json::array();
  for (const Measurement& one : measurements_of(calibration)) {
    steps.push_back({{"name", one.name},
                     {"step_passed", one.passed},
                     {"started_at", calibration.provenance.date()},
                     {"duration", "PT0S"},
                     {"measurement_value", number_or_null(one.value)},
                     {"measurement_unit", one.unit},
                     {"limit_low", limit_or_null(one.low)},
                     {"limit_high", limit_or_null(one.high)}});
  }
  return {.content = text_of(
              Json{{"procedure_name", "axiscal calibrate"},
                   {"unit_under_test",
                    {{"serial_number", instrument.serial}, {"part_number", instrument.model}}},
                   {"run_passed", has_passed(calibration)},
                   {"started_at", calibration.provenance.date()},
                   {"duration", "PT0S"},
                   {"steps", std::move(steps)}}),
          .loss = {},
          .notes = {}};
}

#ifdef AXISCAL_QRENCODE

namespace {

std::string escaped_for_xml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '&':
        escaped += "&amp;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
  }
  return escaped;
}

}  // namespace

// Writes a label of 60 mm x 20 mm as SVG. Its QR code contains the serial number. If a digest is
// given, " sha256:" and the digest follow.
Exported export_label(const Calibration& calibration, const ExportOptions& options) {
  const std::string& serial = calibration.sensor.instrument.serial;
  if (serial.empty()) {
    throw RefusedError("a label needs the serial number of the instrument");
  }
  const std::string code_text =
      options.digest.empty() ? serial : serial + " sha256:" + options.digest;
  const std::unique_ptr<QRcode, void (*)(QRcode*)> code(
      QRcode_encodeString8bit(code_text.c_str(), 0, QR_ECLEVEL_M), QRcode_free);
  if (!code) {
    throw RefusedError("the serial number is too long for a QR code");
  }
  constexpr double side_mm = 17.0;
  constexpr int border = 4;  // width of the quiet zone in modules, required by ISO/IEC 18004
  const double module_mm = side_mm / (code->width + 2 * border);
  std::string path;
  for (int y = 0; y < code->width; ++y) {
    for (int x = 0; x < code->width; ++x) {
      if ((code->data[y * code->width + x] & 1U) != 0) {
        path += formatted("M{} {}h1v1h-1z", x + border, y + border);
      }
    }
  }
  const auto line = [&](double y, double size, const std::string& text, const char* weight) {
    return formatted(
        "<text x=\"20\" y=\"{}\" font-family=\"sans-serif\" font-size=\"{}\" "
        "font-weight=\"{}\">{}</text>\n",
        y, size, weight, escaped_for_xml(text));
  };
  const std::string& date = calibration.provenance.date();
  constexpr std::size_t shown_digits = 16;
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"60mm\" height=\"20mm\" "
      "viewBox=\"0 0 60 20\">\n<rect width=\"60\" height=\"20\" fill=\"#fff\"/>\n";
  svg += formatted("<path transform=\"translate(1.5 1.5) scale({:.5f})\" d=\"{}\"/>\n", module_mm,
                   path);
  svg += line(5.5, 4.0, serial, "bold");
  svg += line(9.5, 2.6, calibration.sensor.instrument.kind, "normal");
  svg += line(13.0, 2.6, "calibrated " + date.substr(0, 10), "normal");
  svg += line(16.5, 2.6,
              calibration.findings.verdict ? (has_passed(calibration) ? "passed" : "failed") : "",
              "normal");
  svg += line(19.0, 1.8, options.digest.substr(0, shown_digits), "normal");
  return {.content = svg + "</svg>\n", .loss = {}, .notes = {}};
}

#endif

}  // namespace axiscal
