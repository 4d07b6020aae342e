// SPDX-License-Identifier: Apache-2.0
#include "exchange/src/consumer.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/exchange/settings.hpp"
#include "axiscal/field/field_unit.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the factor from the record's readings to the readings of the other software.
double reading_factor_of(const Instrument& instrument,
                         const std::string& wanted,
                         const ExportOptions& options) {
  if (options.reading_factor) {
    return *options.reading_factor;
  }
  if (wanted.empty()) {
    return 1.0;
  }
  const std::optional<double> factor = reading_factor_between(instrument.unit, wanted);
  if (!factor) {
    throw RefusedError(formatted("the readings are in '{}', but this format requires {}; give the "
                                 "number of {} that the driver outputs for 1 {}",
                                 instrument.unit, wanted, wanted, instrument.unit),
                       {settings::reading_factor});
  }
  return *factor;
}

// Returns the factor from the record's field to the field of the other software.
double field_factor_of(FieldDescription field,
                       const std::string& wanted,
                       const ExportOptions& options) {
  if (wanted.empty()) {
    return 1.0;
  }
  if (options.local_gravity && field.unit == "g") {
    if (field.local_gravity && *field.local_gravity != *options.local_gravity) {
      throw RefusedError(formatted("the record already states that 1 g is {} m/s^2; do not give "
                                   "another value",
                                   number_text(*field.local_gravity)),
                         {settings::local_gravity});
    }
    field.local_gravity = options.local_gravity;
  }
  try {
    return field_conversion(field, wanted).factor;
  } catch (const DomainError& error) {
    const bool may_state_it = field.unit == "g";
    throw RefusedError(
        std::string(error.what()) + (may_state_it ? "; or give the local gravity" : ""),
        may_state_it ? std::vector{settings::local_gravity} : error.settings());
  }
}

// Returns a basis of the linear space of matrices with the given shape.
std::vector<Eigen::Matrix3d> basis_of(MatrixShape shape) {
  std::vector<Eigen::Matrix3d> basis;
  if (shape == MatrixShape::scalar) {
    return {Eigen::Matrix3d::Identity()};
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      if (i != j && shape != MatrixShape::symmetric) {
        continue;
      }
      Eigen::Matrix3d entry = Eigen::Matrix3d::Zero();
      entry(i, j) = entry(j, i) = 1.0;
      basis.push_back(entry);
    }
  }
  return basis;
}

// Returns the matrix M of the given shape that minimises the Frobenius norm of M S - I, with S the
// sensitivity matrix.
Eigen::Matrix3d nearest_inverse(const Eigen::Matrix3d& S, MatrixShape shape) {
  if (shape == MatrixShape::full) {
    return S.inverse();
  }
  if (shape == MatrixShape::identity) {
    return Eigen::Matrix3d::Identity();
  }
  const std::vector<Eigen::Matrix3d> basis = basis_of(shape);
  Eigen::MatrixXd A(9, static_cast<Eigen::Index>(basis.size()));
  for (std::size_t k = 0; k < basis.size(); ++k) {
    A.col(static_cast<Eigen::Index>(k)) = Eigen::Matrix3d(basis[k] * S).reshaped();
  }
  const Eigen::VectorXd x =
      A.colPivHouseholderQr().solve(Eigen::Matrix3d(Eigen::Matrix3d::Identity()).reshaped());
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < basis.size(); ++k) {
    M += x(static_cast<Eigen::Index>(k)) * basis[k];
  }
  return M;
}

// Returns 1000 directions spread over the sphere, and the positive and negative direction of each
// axis.
std::vector<Eigen::Vector3d> directions() {
  std::vector<Eigen::Vector3d> all = directions_on_sphere(1000);
  for (int axis = 0; axis < 3; ++axis) {
    all.emplace_back(Eigen::Vector3d::Unit(axis));
    all.emplace_back(-Eigen::Vector3d::Unit(axis));
  }
  return all;
}

std::vector<std::optional<SensorTemperature>> temperatures_of(const Calibration& calibration,
                                                              const ConsumerModel& model) {
  if (!calibration.sensor.temperature || model.has_temperature) {
    return {std::nullopt};
  }
  std::vector<std::optional<SensorTemperature>> all;
  const TemperatureResponse& over = *calibration.sensor.temperature;
  constexpr int steps = 4;
  for (int i = 0; i <= steps; ++i) {
    std::vector<double> of_sensors;
    for (const TemperatureSpan& span : over.spans) {
      of_sensors.push_back(span.low + (span.high - span.low) * i / steps);
    }
    all.emplace_back(over.has_own_sensors() ? SensorTemperature(of_sensors)
                                            : SensorTemperature(of_sensors.front()));
  }
  return all;
}

struct Differences {
  double worst = 0.0;
  double rms = 0.0;
  double worst_rad = 0.0;
  double rms_rad = 0.0;
};

Differences differences_of(const Calibration& calibration,
                           const ConsumerModel& model,
                           const std::vector<std::optional<SensorTemperature>>& temperatures) {
  Differences result;
  double count = 0.0;
  for (const std::optional<SensorTemperature>& temperature : temperatures) {
    for (const Eigen::Vector3d& direction : directions()) {
      const Eigen::Vector3d field = calibration.sensor.field.magnitude * direction;
      const Eigen::Vector3d reading =
          model.reading_factor * response_at(calibration.sensor, field, temperature);
      Eigen::Vector3d bias = model.bias;
      if (model.has_bias_over_temperature && temperature) {
        const TemperatureResponse& over = *calibration.sensor.temperature;
        const double d = temperature->mean() - over.spans.front().reference;
        for (Eigen::Index i = 0; i < over.bias.cols(); ++i) {
          bias += model.reading_factor * std::pow(d, i + 1) * over.bias.col(i);
        }
      }
      const Eigen::Vector3d got = model.inverse * (reading - bias) / model.field_factor;
      const double off = (got - field).norm();
      const double angle = std::atan2(field.cross(got).norm(), field.dot(got));
      result.worst = std::max(result.worst, off);
      result.worst_rad = std::max(result.worst_rad, angle);
      result.rms += off * off;
      result.rms_rad += angle * angle;
      count += 1.0;
    }
  }
  result.rms = std::sqrt(result.rms / count);
  result.rms_rad = std::sqrt(result.rms_rad / count);
  return result;
}

}  // namespace

void require_three_axes(const Calibration& calibration, std::string_view format) {
  if (calibration.sensor.instrument.axis_count() != 3 || calibration.sensor.instrument.one_sided) {
    throw RefusedError(
        formatted("format {} supports only instruments with three axes, and it does not support "
                  "one-sided axes",
                  format));
  }
}

Sensor sensor_of(const Calibration& calibration, std::string_view format) {
  const std::string& kind = calibration.sensor.instrument.kind;
  const std::string of_format = "format " + std::string(format);
  require_three_axes(calibration, format);
  const Sensor sensor = find_instrument_kind(kind).sensor;
  if (sensor != Sensor::none) {
    return sensor;
  }
  throw RefusedError(formatted(
      "{} does not support this instrument ({}); it supports only accelerometers, gyroscopes and "
      "magnetometers",
      of_format, kind));
}

std::string usual_unit(Sensor sensor, const std::string& of_magnetometer) {
  switch (sensor) {
    case Sensor::accelerometer:
      return "m/s^2";
    case Sensor::gyroscope:
      return "rad/s";
    default:
      return of_magnetometer;
  }
}

ConsumerModel nearest_model(const Calibration& calibration,
                            const ConsumerUnits& units,
                            MatrixShape shape,
                            const ExportOptions& options) {
  ConsumerModel model;
  model.reading_factor = reading_factor_of(calibration.sensor.instrument, units.reading, options);
  model.field_factor = field_factor_of(calibration.sensor.field, units.field, options);
  const Eigen::Matrix3d S =
      model.reading_factor / model.field_factor * calibration.sensor.response.sensitivity;
  if (!(std::abs(S.determinant()) > 0.0)) {
    throw RefusedError(
        "the sensitivities do not determine the field: no other program can use "
        "this calibration");
  }
  model.inverse = nearest_inverse(S, shape);
  model.bias = model.reading_factor * calibration.sensor.response.bias;
  constexpr double largest = 1e100;  // products of larger numbers may overflow in other software
  if (!model.inverse.allFinite() || !(model.bias.cwiseAbs().maxCoeff() < largest) ||
      !(calibration.sensor.field.magnitude < largest)) {
    throw RefusedError(
        "a coefficient is too large to be valid; check the record and the reading factor",
        {settings::reading_factor});
  }
  return model;
}

std::optional<ExportLoss> loss_of(const Calibration& calibration, const ConsumerModel& model) {
  constexpr double rounding = 1e-9;  // largest relative difference that counts as rounding
  ExportLoss loss{.unit = calibration.sensor.field.unit};
  const double F = calibration.sensor.field.magnitude;
  const Eigen::Matrix3d M = model.inverse * model.reading_factor / model.field_factor *
                            calibration.sensor.response.sensitivity;
  const Eigen::Matrix3d off = M - Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d cross = off - Eigen::Matrix3d(off.diagonal().asDiagonal());
  if (cross.cwiseAbs().maxCoeff() > rounding) {
    loss.what.emplace_back("cross-axis terms");
  }
  if (off.diagonal().cwiseAbs().maxCoeff() > rounding && cross.norm() < off.diagonal().norm()) {
    loss.what.emplace_back("sensitivities");
  }
  const Eigen::Vector3d shift =
      model.inverse * (model.reading_factor * calibration.sensor.response.bias - model.bias);
  if (shift.norm() > rounding * F * model.field_factor) {
    loss.what.emplace_back("the last digits of the bias");
  }
  if (calibration.sensor.temperature && model.has_bias_over_temperature) {
    if (calibration.sensor.temperature->scale.cwiseAbs().sum() > 0.0) {
      loss.what.emplace_back("sensitivities over temperature");
    }
  } else if (calibration.sensor.temperature && !model.has_temperature) {
    loss.what.emplace_back("temperature");
  }
  if (!calibration.sensor.also.empty() && !model.has_also) {
    loss.what.emplace_back(
        formatted("response to {} (not included in the errors that are given "
                  "here)",
                  calibration.sensor.also.front().kind));
  }
  if (loss.what.empty()) {
    return std::nullopt;
  }
  const Differences found = differences_of(calibration, model, temperatures_of(calibration, model));
  loss.worst = found.worst;
  loss.rms = found.rms;
  loss.worst_deg = found.worst_rad * deg_per_rad;
  loss.rms_deg = found.rms_rad * deg_per_rad;
  return loss;
}

std::optional<ExportLoss> accepted_loss(const Calibration& calibration,
                                        const ConsumerModel& model,
                                        std::string_view format,
                                        const ExportOptions& options) {
  std::optional<ExportLoss> loss = loss_of(calibration, model);
  if (loss && !options.lossy) {
    throw RefusedError(
        formatted("format {} cannot store {}; to write the file nevertheless, allow the "
                  "loss",
                  format, loss_text(*loss)),
        {settings::lossy});
  }
  return loss;
}

std::string loss_text(const ExportLoss& loss) {
  const auto rounded = [](double value) { return number_text(value, 3); };
  return formatted(
      "{}; without these, the errors of the field are up to {} {} and {} degrees (rms {} {}, {} "
      "degrees)",
      joined(loss.what), rounded(loss.worst), loss.unit, rounded(loss.worst_deg), rounded(loss.rms),
      loss.unit, rounded(loss.rms_deg));
}

namespace {

// Removes characters that would end a comment, start a new line or reverse the direction of the
// text.
std::string fit_for_comment(std::string line) {
  std::replace_if(
      line.begin(), line.end(),
      [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f' || c == '\\'; }, ' ');
  for (const std::string_view end : {"*/", "/*", "?\?/", "--"}) {
    for (std::size_t at = line.find(end); at != std::string::npos; at = line.find(end, at)) {
      line.insert(at + 1, " ");
    }
  }
  // U+200E, U+200F, U+202A .. U+202E, U+2066 .. U+2069 control the direction of the text.
  for (std::size_t at = line.find("\xE2"); at != std::string::npos;
       at = line.find("\xE2", at + 1)) {
    if (at + 2 >= line.size()) {
      break;
    }
    const auto second = static_cast<unsigned char>(line[at + 1]);
    const auto third = static_cast<unsigned char>(line[at + 2]);
    const bool turns =
        (second == 0x80 && (third == 0x8E || third == 0x8F || (third >= 0xAA && third <= 0xAE))) ||
        (second == 0x81 && third >= 0xA6 && third <= 0xA9);
    if (turns) {
      line.replace(at, 3, " ");
    }
  }
  return line;
}

}  // namespace

std::string source_line(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  std::string line = instrument.kind;
  if (!instrument.serial.empty()) {
    line += formatted(" '{}'", instrument.serial);
  }
  if (!calibration.provenance.date().empty()) {
    line += ", calibrated " + calibration.provenance.date();
  }
  if (!calibration.provenance.software.empty()) {
    line += " by " + calibration.provenance.software;
  }
  return fit_for_comment(line);
}

std::vector<std::string> comment_of(const Calibration& calibration,
                                    const std::vector<std::string>& lines,
                                    const std::optional<ExportLoss>& loss) {
  std::vector<std::string> comment = {source_line(calibration)};
  if (calibration.findings.status == CalibrationStatus::refused) {
    comment.emplace_back("THIS CALIBRATION WAS REFUSED: do not rely on it.");
  }
  for (const std::string& line : lines) {
    comment.push_back(fit_for_comment(line));
  }
  if (loss) {
    comment.push_back(formatted("Not stored: {}.", fit_for_comment(loss_text(*loss))));
  }
  return comment;
}

Calibration with_measured_field(const Calibration& calibration) {
  Calibration own = calibration;
  const Eigen::Matrix3d S = calibration.sensor.response.sensitivity;
  const double size = std::cbrt(std::abs(S.determinant()));
  if (calibration.sensor.field.unit == "1" && calibration.sensor.field.magnitude == 1.0 &&
      is_reading_unit(calibration.sensor.instrument.unit) && size > 0.0 && std::isfinite(size)) {
    const std::string& unit = calibration.sensor.instrument.unit;
    own.sensor.field.unit = unit == "gauss" ? "G" : unit == "mgauss" ? "mG" : unit;
    own.sensor.field.magnitude = size;
    own.sensor.response.sensitivity = S / size;
  }
  return own;
}

std::string worked_example(const Calibration& calibration, const ConsumerModel& model) {
  constexpr int digits = 7;
  const auto text_of = [](const Eigen::Vector3d& v) {
    return formatted("({}, {}, {})", number_text(v(0), digits), number_text(v(1), digits),
                     number_text(v(2), digits));
  };
  const Eigen::Vector3d field = calibration.sensor.field.magnitude * Eigen::Vector3d(0.6, 0.0, 0.8);
  Eigen::Vector3d reading =
      model.reading_factor *
      (calibration.sensor.response.bias + calibration.sensor.response.sensitivity * field);
  for (double& v : reading) {  // rounds to the digits of the printed text
    v = parse_number(number_text(v, digits)).value_or(v);
  }
  const Eigen::Vector3d corrected = model.inverse * (reading - model.bias);
  return formatted("for example v = {} becomes {}", text_of(reading), text_of(corrected));
}

std::string comment_lines(const Calibration& calibration,
                          std::string_view mark,
                          const std::vector<std::string>& lines,
                          const std::optional<ExportLoss>& loss) {
  std::string text;
  for (const std::string& line : comment_of(calibration, lines, loss)) {
    text += formatted("{}{}\n", mark, line);
  }
  return text;
}

}  // namespace axiscal
