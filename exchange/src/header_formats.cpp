// SPDX-License-Identifier: Apache-2.0
// Formats c-header and cpp-header: the coefficients, and a short function that applies them.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/exchange/settings.hpp"
#include "core/formatted.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  });
  return text;
}

std::string literal(double value, bool single) {
  if (single && std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
    throw RefusedError("a coefficient is too large for a float; use double", {settings::numbers});
  }
  std::string text = single ? number_text(value, 9) : number_text(value);
  if (text.find_first_of(".en") == std::string::npos) {
    text += ".0";
  }
  return single ? text + "f" : text;
}

// Returns a matrix as an initialiser in C: {{a, b, c}, {..}, {..}}.
// @param write  function that formats a number.
template <typename Write>
std::string braces(const Eigen::Ref<const Eigen::MatrixXd>& values, const Write& write) {
  std::string text = "{";
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    text += i > 0 ? ", {" : "{";
    for (Eigen::Index j = 0; j < values.cols(); ++j) {
      text += (j > 0 ? ", " : "") + write(values(i, j));
    }
    text += "}";
  }
  return text + "}";
}

template <typename Write>
std::string list(const Eigen::Ref<const Eigen::VectorXd>& values, const Write& write) {
  const std::string row = braces(values.transpose(), write);
  return row.substr(1, row.size() - 2);
}

// The syntax of a header in C or C++: constants, include guard, begin and end of the file.
struct Dialect {
  bool is_cpp = false;
  std::string name;

  [[nodiscard]] std::string constant(const std::string& type,
                                     const std::string& what,
                                     const std::string& sizes,
                                     const std::string& value) const {
    return formatted("{}{} {}{}{} = {};\n", is_cpp ? "inline constexpr " : "static const ", type,
                     prefix(), what, sizes, value);
  }
  [[nodiscard]] std::string prefix() const { return is_cpp ? "" : name + "_"; }
  [[nodiscard]] std::string open() const {
    const std::string guard = upper(name) + (is_cpp ? "_CALIBRATION_HPP" : "_CALIBRATION_H");
    return formatted("#ifndef {}\n#define {}\n\n{}", guard, guard,
                     is_cpp ? formatted("#include <cstdint>\n\nnamespace {} {{\n\n", name)
                            : "#include <stdint.h>\n\n");
  }
  [[nodiscard]] std::string close() const {
    return is_cpp ? formatted("\n}}  // namespace {}\n\n#endif\n", name) : "\n#endif\n";
  }
  [[nodiscard]] std::string function() const {
    return is_cpp ? "constexpr void apply" : formatted("static inline void {}_apply", name);
  }
};

// Returns the prefix of the names in a header. By default it contains kind and slot, so that one
// program can include the headers of two instruments.
std::string header_name(const Calibration& calibration, const ExportOptions& options) {
  if (!options.name.empty()) {
    return options.name;
  }
  std::string name = "axiscal_" + calibration.sensor.instrument.kind;
  if (!calibration.provenance.slot.empty() &&
      calibration.provenance.slot != calibration.sensor.instrument.kind) {
    name += "_" + calibration.provenance.slot;
  }
  std::replace_if(
      name.begin(), name.end(),
      [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

std::vector<std::string> remarks(const Calibration& calibration, bool temperature) {
  std::vector<std::string> lines = {
      formatted("field [{}] in the instrument's frame from readings v [{}], axes {}",
                calibration.sensor.field.unit, calibration.sensor.instrument.unit,
                joined(calibration.sensor.instrument.axes)),
      temperature ? "field = inverse ((v - bias - bias_terms d) / (1 + scale_terms d)), powers d, "
                    "d^2, ... of d = temperature - reference_temperature"
                  : "field = inverse (v - bias)"};
  if (temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    lines.push_back(
        "calibrated from temperature " +
        span_text(over, calibration.sensor.instrument.axes, [](const TemperatureSpan& span) {
          return formatted("{} to {}", number_text(span.low, 6), number_text(span.high, 6));
        }));
    if (over.has_own_sensors()) {
      lines.emplace_back(
          "temperature and reference_temperature are those of each axis's own temperature sensor");
    }
  }
  return lines;
}

std::string comment(const Calibration& calibration,
                    const std::vector<std::string>& lines,
                    const std::optional<ExportLoss>& loss) {
  return formatted("/*\n{} */\n", comment_lines(calibration, " * ", lines, loss));
}

Exported floating_header(const Calibration& calibration,
                         const ExportOptions& options,
                         const Dialect& dialect,
                         ConsumerModel model,
                         std::string_view format) {
  const bool single = options.numbers.type == HeaderNumbers::Type::float32;
  const std::string type = single ? "float" : "double";
  const auto number = [&](double value) { return literal(value, single); };
  const bool temperature = calibration.sensor.temperature.has_value();
  model.has_temperature = true;
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, format, options);
  std::string text = comment(calibration, remarks(calibration, temperature), loss) + dialect.open();
  text += dialect.constant(type, "bias", "[3]", list(model.bias, number));
  text += dialect.constant(type, "inverse", "[3][3]", braces(model.inverse, number));
  const std::string p = dialect.prefix();
  if (temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    const std::string order = std::to_string(over.bias.cols());
    const bool own = over.has_own_sensors();
    Eigen::Vector3d reference;
    for (Eigen::Index k = 0; k < 3; ++k) {
      reference(k) = over.span_of(k).reference;
    }
    text += dialect.constant(type, "reference_temperature", own ? "[3]" : "",
                             own ? list(reference, number) : number(reference(0)));
    text += dialect.constant(type, "bias_terms", formatted("[3][{}]", order),
                             braces(over.bias, number));
    text += dialect.constant(type, "scale_terms", formatted("[3][{}]", order),
                             braces(over.scale, number));
    text += formatted(
        "\n{}(const {} v[3], {}, {} field[3]) {{\n"
        "  {} u[3] = {{0, 0, 0}};\n",
        dialect.function(), type,
        own ? formatted("const {} temperature[3]", type) : formatted("{} temperature", type), type,
        type);
    text += formatted(
        "  for (int k = 0; k < 3; ++k) {{\n"
        "    const {} d = temperature{} - {}reference_temperature{};\n",
        type, own ? "[k]" : "", p, own ? "[k]" : "");
    text += formatted(
        "    {} bias_at = 0;\n"
        "    {} scale_at = 0;\n"
        "    for (int i = {} - 1; i >= 0; --i) {{\n"
        "      bias_at = (bias_at + {}bias_terms[k][i]) * d;\n"
        "      scale_at = (scale_at + {}scale_terms[k][i]) * d;\n"
        "    }}\n"
        "    u[k] = (v[k] - {}bias[k] - bias_at) / (1 + scale_at);\n"
        "  }}\n",
        type, type, order, p, p, p);
  } else {
    text += formatted(
        "\n{}(const {} v[3], {} field[3]) {{\n"
        "  const {} u[3] = {{v[0] - {}bias[0], v[1] - {}bias[1], v[2] - {}bias[2]}};\n",
        dialect.function(), type, type, type, p, p, p);
  }
  text += formatted(
      "  for (int j = 0; j < 3; ++j) {{\n"
      "    field[j] = {}inverse[j][0] * u[0] + {}inverse[j][1] * u[1] + {}inverse[j][2] * u[2];\n"
      "  }}\n"
      "}}\n",
      p, p, p);
  return {.content = text + dialect.close(), .loss = loss};
}

std::string integer(double value) {
  return std::to_string(static_cast<std::int64_t>(value));
}

// Writes a header that computes with integers. The options state the fractional bits of readings
// and field. The inverse matrix gets the largest number of fractional bits for which all of its
// entries fit into 31 bits, including the sign.
Exported fixed_header(const Calibration& calibration,
                      const ExportOptions& options,
                      const Dialect& dialect,
                      ConsumerModel model,
                      std::string_view format) {
  constexpr double largest = 1073741823.0;  // 2^30 - 1
  // Largest field that the integers must hold, as a multiple of the calibration's field.
  constexpr double times_field = 8.0;
  const int reading_bits = options.numbers.reading_bits;
  const int field_bits = options.numbers.field_bits;
  const double span = model.bias.cwiseAbs().maxCoeff() +
                      times_field * calibration.sensor.field.magnitude *
                          (model.reading_factor * calibration.sensor.response.sensitivity)
                              .rowwise()
                              .norm()
                              .maxCoeff();
  // The bias has more fractional bits than the readings, so that the bias is not rounded to whole
  // counts.
  int more = 0;
  while (more < 12 && std::ldexp(span, reading_bits + more + 1) < largest) {
    ++more;
  }
  const int bias_bits = reading_bits + more;
  int inverse_bits = -30;
  while (inverse_bits < 60 &&
         std::ldexp(model.inverse.cwiseAbs().maxCoeff(), inverse_bits + 1) < largest) {
    ++inverse_bits;
  }
  const bool field_fits =
      std::ldexp(times_field * calibration.sensor.field.magnitude, field_bits) < 2.0 * largest;
  const int shift = inverse_bits + bias_bits - field_bits;
  if (shift < 1 || shift > 62 || std::ldexp(span, bias_bits) >= largest || !field_fits) {
    throw RefusedError(
        formatted("readings, coefficients or a field of {} times {} {} do not fit into 32 bits "
                  "with {} binary places of the readings and {} binary places of the field; choose "
                  "fewer binary places",
                  number_text(times_field), number_text(calibration.sensor.field.magnitude, 4),
                  calibration.sensor.field.unit, reading_bits, field_bits));
  }
  const Eigen::Vector3d bias = (model.bias * std::ldexp(1.0, bias_bits)).array().round();
  const Eigen::Matrix3d inverse = (model.inverse * std::ldexp(1.0, inverse_bits)).array().round();
  const ConsumerModel exact = model;
  model.bias = bias * std::ldexp(1.0, -bias_bits);
  model.inverse = inverse * std::ldexp(1.0, -inverse_bits);
  // Rounding errors are not reported as a loss, but missing temperature terms are.
  const std::optional<ExportLoss> loss = accepted_loss(calibration, exact, format, options);
  const std::optional<ExportLoss> rounding = loss_of(calibration, model);
  const std::string places = std::to_string(field_bits);
  std::vector<std::string> lines = remarks(calibration, false);
  lines.push_back(
      formatted("readings are int32_t, v * 2^{} rounded; the field is int32_t, f * 2^{}, and may "
                "be up to {} times the field of the calibration",
                reading_bits, places, number_text(times_field)));
  if (rounding) {
    lines.push_back(formatted("rounding of the coefficients: up to {} {}; of the field: up to {}",
                              number_text(rounding->worst, 2), calibration.sensor.field.unit,
                              number_text(std::ldexp(0.5, -field_bits), 2)));
  }
  lines.push_back(formatted(
      "rounding of a reading: up to {} {}",
      number_text(std::ldexp(0.5, -reading_bits) * exact.inverse.rowwise().lpNorm<1>().maxCoeff(),
                  2),
      calibration.sensor.field.unit));
  std::string text = comment(calibration, lines, loss) + dialect.open();
  text += dialect.constant("int32_t", "bias", "[3]", list(bias, integer));
  text += dialect.constant("int32_t", "inverse", "[3][3]", braces(inverse, integer));
  const std::string p = dialect.prefix();
  const std::string scale = formatted("(INT64_C(1) << {})", more);
  text += formatted(
      "\n{}(const int32_t v[3], int32_t field[3]) {{\n"
      "  const int64_t u[3] = {{v[0] * {} - {}bias[0], v[1] * {} - {}bias[1], v[2] * {} - "
      "{}bias[2]}};\n"
      "  for (int j = 0; j < 3; ++j) {{\n"
      "    const int64_t sum = {}inverse[j][0] * u[0] + {}inverse[j][1] * u[1] + {}inverse[j][2] * "
      "u[2];\n"
      "    const int64_t half = INT64_C(1) << {};\n"
      "    field[j] = (int32_t)((sum < 0 ? sum - half : sum + half) / (2 * half));\n"
      "  }}\n"
      "}}\n",
      dialect.function(), scale, p, scale, p, scale, p, p, p, p, shift - 1);
  return {.content = text + dialect.close(), .loss = loss};
}

Exported header(const Calibration& record,
                const ExportOptions& options,
                bool is_cpp,
                std::string_view format) {
  const Calibration calibration = in_assembly_frame(record);  // `apply` uses this frame too
  require_three_axes(calibration, format);
  const Dialect dialect{.is_cpp = is_cpp, .name = header_name(calibration, options)};
  const ConsumerModel model = nearest_model(calibration, {}, MatrixShape::full, options);
  return options.numbers.type == HeaderNumbers::Type::fixed
             ? fixed_header(calibration, options, dialect, model, format)
             : floating_header(calibration, options, dialect, model, format);
}

}  // namespace

Exported export_c_header(const Calibration& calibration, const ExportOptions& options) {
  return header(calibration, options, false, "c-header");
}

Exported export_cpp_header(const Calibration& calibration, const ExportOptions& options) {
  return header(calibration, options, true, "cpp-header");
}

}  // namespace axiscal
