// SPDX-License-Identifier: Apache-2.0
// Formats px4, ardupilot and betaflight: parameters of flight controllers.
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/exchange/settings.hpp"
#include "axiscal/field/field_unit.hpp"
#include "core/formatted.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

struct Parameter {
  std::string name;
  double value;
};

// Adds one parameter per axis. Each name consists of the prefix, the axis letter and the suffix.
void add_axes(std::vector<Parameter>& all,
              const std::string& prefix,
              const std::string& suffix,
              const Eigen::Vector3d& values) {
  for (int k = 0; k < 3; ++k) {
    all.push_back({axis_parameter(prefix, k, suffix), values(k)});
  }
}

Eigen::Vector3d above_diagonal(const Eigen::Matrix3d& M) {
  return {M(0, 1), M(0, 2), M(1, 2)};
}

// Returns the shape of the matrix by which flight controllers correct a sensor.
MatrixShape shape_in_flight(Sensor sensor) {
  switch (sensor) {
    case Sensor::accelerometer:
      return MatrixShape::diagonal;
    case Sensor::gyroscope:
      return MatrixShape::identity;
    default:
      return MatrixShape::symmetric;
  }
}

void require_instance(const ExportOptions& options, int most, std::string_view format) {
  if (options.instance >= most) {
    throw RefusedError(
        formatted("format {} supports only the sensors 0 to {} of this kind", format, most - 1));
  }
}

std::vector<std::string> in_flight(Sensor sensor,
                                   const std::string& formula,
                                   const std::string& frame) {
  const std::string unit = usual_unit(sensor, "");
  return {formula + (unit.empty() ? "" : ", in " + unit), frame};
}

// Flight controllers model the bias of accelerometers and gyroscopes as a polynomial of third order
// in the temperature of the sensor.
constexpr Eigen::Index thermal_order = 3;

bool has_thermal_terms(const Calibration& calibration, Sensor sensor) {
  const auto& over = calibration.sensor.temperature;
  return sensor != Sensor::magnetometer && over && !over->has_own_sensors() &&
         over->bias.cols() <= thermal_order;
}

// Returns the temperature coefficients of the bias, with one row per axis. The columns belong to d,
// d^2 and d^3, with d the temperature minus the reference temperature. The unit is the consumer's
// unit of the readings per degC, degC^2 and degC^3.
Eigen::Matrix3d thermal_terms(const Calibration& calibration, const ConsumerModel& model) {
  Eigen::Matrix3d terms = Eigen::Matrix3d::Zero();
  const Eigen::MatrixXd& bias = calibration.sensor.temperature->bias;
  terms.leftCols(bias.cols()) = model.reading_factor * bias;
  return terms;
}

constexpr const char* thermal_remark =
    "temperatures are those of the sensor's own thermometer, in degrees Celsius";

// Returns the thermal parameters of PX4. The offset is X1 d + X2 d^2 + X3 d^3 with d = t - TREF and
// the temperature t. PX4 subtracts this offset from the reading before it applies OFF and SCALE.
std::string px4_thermal_lines(const Calibration& calibration,
                              const ConsumerModel& model,
                              Sensor sensor,
                              int instance) {
  const char letter = sensor == Sensor::accelerometer ? 'A' : 'G';
  const TemperatureSpan& span = calibration.sensor.temperature->spans.front();
  const Eigen::Matrix3d terms = thermal_terms(calibration, model);
  const std::string prefix = formatted("TC_{}{}_", letter, instance);
  std::string text = formatted("1\t1\tTC_{}_ENABLE\t1\t6\n", letter);
  const auto add = [&](const std::string& name, double value) {
    text += formatted("1\t1\t{}\t{}\t9\n", prefix + name, number_text(value));
  };
  if (!calibration.provenance.device.empty() && parse_number(calibration.provenance.device)) {
    text += formatted("1\t1\t{}ID\t{}\t6\n", prefix, calibration.provenance.device);
  }
  add("TREF", span.reference);
  add("TMIN", span.low);
  add("TMAX", span.high);
  for (int power = 0; power <= thermal_order; ++power) {
    for (int k = 0; k < 3; ++k) {
      add(formatted("X{}_{}", power, k), power == 0 ? 0.0 : terms(k, power - 1));
    }
  }
  return text;
}

// Returns the thermal parameters of ArduPilot. The offset at the temperature t is
// P(t - 35) - P(CALTEMP - 35), with a polynomial P of third order. The parameters are the
// coefficients of P times 1e6.
std::vector<Parameter> ardupilot_thermal_parameters(const Calibration& calibration,
                                                    const ConsumerModel& model,
                                                    Sensor sensor,
                                                    int instance) {
  constexpr double about = 35.0;
  const TemperatureSpan& span = calibration.sensor.temperature->spans.front();
  const double h = about - span.reference;
  const Eigen::Matrix3d b = thermal_terms(calibration, model);
  Eigen::Matrix3d about_35;
  about_35.col(0) = b.col(0) + 2.0 * h * b.col(1) + 3.0 * h * h * b.col(2);
  about_35.col(1) = b.col(1) + 3.0 * h * b.col(2);
  about_35.col(2) = b.col(2);
  const bool is_gyroscope = sensor == Sensor::gyroscope;
  const std::string name = is_gyroscope ? "GYR" : "ACC";
  const std::string number = std::to_string(instance + 1);
  const std::string prefix =
      instance < 3 ? formatted("INS_TCAL{}_", number) : formatted("INS{}_TCAL_", number);
  std::vector<Parameter> all = {
      {prefix + "ENABLE", 1.0}, {prefix + "TMIN", span.low}, {prefix + "TMAX", span.high}};
  constexpr double stored_as = 1e6;
  for (int power = 1; power <= thermal_order; ++power) {
    add_axes(all, formatted("{}{}{}_", prefix, name, power), "",
             stored_as * about_35.col(power - 1));
  }
  all.push_back({instance < 3 ? formatted("INS_{}{}_CALTEMP", name, number)
                              : formatted("INS{}_{}_CALTEMP", number, name),
                 span.reference});
  return all;
}

}  // namespace

Exported export_px4(const Calibration& given, const ExportOptions& options) {
  const Sensor sensor = sensor_of(given, "px4");
  const Calibration calibration =
      sensor == Sensor::magnetometer ? with_measured_field(given) : given;
  require_instance(options, 4, "px4");
  const std::string unit = usual_unit(sensor, "G");
  ConsumerModel model = nearest_model(calibration, {unit, unit}, shape_in_flight(sensor), options);
  model.has_bias_over_temperature = has_thermal_terms(calibration, sensor);
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, "px4", options);
  const int instance = options.instance > 0 ? options.instance : calibration.provenance.instance;
  const std::string number = formatted("{}_", instance);
  std::vector<Parameter> all;
  std::string formula;
  std::string prefix;
  if (sensor == Sensor::accelerometer) {
    prefix = "CAL_ACC" + number;
    formula = "field = (v - OFF) * SCALE";
    add_axes(all, prefix, "OFF", model.bias);
    add_axes(all, prefix, "SCALE", model.inverse.diagonal());
  } else if (sensor == Sensor::gyroscope) {
    prefix = "CAL_GYRO" + number;
    formula = "field = v - OFF";
    add_axes(all, prefix, "OFF", model.bias);
  } else {
    prefix = "CAL_MAG" + number;
    formula =
        "field = M (v - OFF) in gauss, M = [XSCALE XODIAG YODIAG; XODIAG YSCALE ZODIAG; "
        "YODIAG ZODIAG ZSCALE]";
    add_axes(all, prefix, "OFF", model.bias);
    add_axes(all, prefix, "SCALE", model.inverse.diagonal());
    add_axes(all, prefix, "ODIAG", above_diagonal(model.inverse));
  }
  std::vector<std::string> lines =
      in_flight(sensor, formula,
                "v is in the frame in which PX4 publishes the sensor, before the board's rotation");
  lines.push_back(formatted(
      "PX4 applies these values only if the parameter {}ID is the sensor's device number", prefix));
  lines.push_back(worked_example(calibration, model));
  if (model.has_bias_over_temperature) {
    lines.emplace_back(thermal_remark);
  }
  lines.emplace_back("vehicle, component, name, value, type (9: float)");
  std::string text = comment_lines(calibration, "# ", lines, loss);
  if (!calibration.provenance.device.empty() && parse_number(calibration.provenance.device)) {
    // The last number is the type code of PX4: 6 for an integer.
    text += formatted("1\t1\t{}ID\t{}\t6\n", prefix, calibration.provenance.device);
  }
  for (const Parameter& parameter : all) {
    text += formatted("1\t1\t{}\t{}\t9\n", parameter.name, number_text(parameter.value));
  }
  if (model.has_bias_over_temperature) {
    text += px4_thermal_lines(calibration, model, sensor, instance);
  }
  return {.content = text, .loss = loss};
}

std::string axis_parameter(const std::string& prefix, int k, const std::string& suffix) {
  return prefix + "XYZ"[k] + suffix;
}

std::string ardupilot_group(int instance, std::string_view sensor) {
  const std::string number = std::to_string(instance + 1);
  // From the fourth sensor on, each sensor has its own parameter group, INS4, INS5, ..
  const std::string name(sensor);
  return instance == 0  ? "INS_" + name
         : instance < 3 ? formatted("INS_{}{}", name, number)
                        : formatted("INS{}_{}", number, name);
}

Exported export_ardupilot(const Calibration& given, const ExportOptions& options) {
  const Sensor sensor = sensor_of(given, "ardupilot");
  const Calibration calibration =
      sensor == Sensor::magnetometer ? with_measured_field(given) : given;
  const std::string unit = usual_unit(sensor, "mG");
  ConsumerModel model = nearest_model(calibration, {unit, unit}, shape_in_flight(sensor), options);
  model.has_bias_over_temperature = has_thermal_terms(calibration, sensor);
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, "ardupilot", options);
  const bool is_compass = sensor == Sensor::magnetometer;
  const bool is_gyroscope = sensor == Sensor::gyroscope;
  require_instance(options, is_compass ? 3 : 5, "ardupilot");
  const int instance = options.instance > 0 ? options.instance : calibration.provenance.instance;
  const std::string ins = ardupilot_group(instance, is_gyroscope ? "GYR" : "ACC");
  const std::string number = instance == 0 ? "" : std::to_string(instance + 1);
  std::vector<Parameter> all;
  std::vector<std::string> lines;
  if (sensor == Sensor::accelerometer) {
    lines = in_flight(sensor, "field = (v - ACCOFFS) * ACCSCAL",
                      "v is in the sensor's own frame, before the board's rotation");
    add_axes(all, ins + "OFFS_", "", model.bias);
    add_axes(all, ins + "SCAL_", "", model.inverse.diagonal());
  } else if (sensor == Sensor::gyroscope) {
    lines = in_flight(sensor, "field = v - GYROFFS",
                      "v is in the sensor's own frame, before the board's rotation; ArduPilot "
                      "keeps these offsets if INS_GYR_CAL is 0, otherwise it measures them at each "
                      "start");
    add_axes(all, ins + "OFFS_", "", model.bias);
  } else {
    lines =
        in_flight(sensor,
                  "field = M (v + OFS) in milligauss, M = [DIA_X ODI_X ODI_Y; ODI_X DIA_Y ODI_Z; "
                  "ODI_Y ODI_Z DIA_Z]",
                  "v is in the vehicle's frame: the readings after the rotations by COMPASS_ORIENT "
                  "and AHRS_ORIENTATION");
    add_axes(all, formatted("COMPASS_OFS{}_", number), "", -model.bias);
    add_axes(all, formatted("COMPASS_DIA{}_", number), "", model.inverse.diagonal());
    add_axes(all, formatted("COMPASS_ODI{}_", number), "", above_diagonal(model.inverse));
    all.push_back({"COMPASS_SCALE" + number, 0.0});  // 0: no scale in addition to the matrix
  }
  lines.push_back(worked_example(calibration, model));
  if (!calibration.provenance.device.empty() && parse_number(calibration.provenance.device)) {
    const std::string name = is_compass ? "COMPASS_DEV_ID" + number : ins + "_ID";
    all.push_back({name, *parse_number(calibration.provenance.device)});
  }
  if (model.has_bias_over_temperature) {
    lines.emplace_back(thermal_remark);
    for (Parameter& parameter :
         ardupilot_thermal_parameters(calibration, model, sensor, instance)) {
      all.push_back(std::move(parameter));
    }
  }
  std::string text = comment_lines(calibration, "# ", lines, loss);
  for (const Parameter& parameter : all) {
    text += formatted("{},{}\n", parameter.name, number_text(parameter.value));
  }
  return {.content = text, .loss = loss};
}

Exported export_betaflight(const Calibration& calibration, const ExportOptions& options) {
  const Sensor sensor = sensor_of(calibration, "betaflight");
  if (sensor == Sensor::gyroscope) {
    throw RefusedError(
        "Betaflight does not store a calibration of a gyroscope: it measures the bias at each "
        "start");
  }
  // Betaflight's values are in counts. The number of counts per g is a constant in the driver of
  // each sensor; it is a power of two.
  ConsumerModel model = nearest_model(calibration, {}, MatrixShape::scalar, options);
  double per_field = 1.0 / model.inverse(0, 0);
  std::vector<std::string> lines;
  if (sensor == Sensor::accelerometer) {
    const ConsumerModel in_g = nearest_model(calibration, {"", "g"}, MatrixShape::scalar, options);
    const double one_g = std::exp2(std::round(std::log2(std::abs(1.0 / in_g.inverse(0, 0)))));
    if (one_g < 256.0) {
      throw RefusedError(
          formatted("Betaflight requires readings in counts (1 g is some thousands of counts), but "
                    "in this record 1 g is {} {}; give the number of counts for 1 {}",
                    number_text(std::abs(1.0 / in_g.inverse(0, 0)), 3),
                    calibration.sensor.instrument.unit, calibration.sensor.instrument.unit),
          {settings::reading_factor});
    }
    per_field = std::copysign(one_g, per_field) * in_g.field_factor;
    lines.emplace_back("v is in counts, after the sensor's alignment to the board");
    lines.push_back(
        formatted("field = (v - acc_calibration) / acc_1G; acc_1G of this sensor is {} (a constant "
                  "of its driver, not set by these lines)",
                  number_text(one_g)));
  } else {
    // The Earth's field (22 to 67 uT) gives several hundred counts. A much smaller reading is
    // probably in another unit than counts.
    const std::string& unit = calibration.sensor.instrument.unit;
    const double size = std::cbrt(std::abs(calibration.sensor.response.sensitivity.determinant())) *
                        calibration.sensor.field.magnitude;
    constexpr double fewest_counts = 70.0;
    if (!options.reading_factor && (is_reading_unit(unit) || size < fewest_counts)) {
      throw RefusedError(
          formatted("Betaflight requires readings in counts, but the readings are in {}; give the "
                    "number of counts for 1 {}",
                    unit, unit),
          {settings::reading_factor});
    }
    lines.emplace_back("field = v - mag_calibration, in counts, after the sensor's alignment");
  }
  model.inverse = Eigen::Matrix3d::Identity() / per_field;
  model.bias = model.bias.array().round();
  if (model.bias.cwiseAbs().maxCoeff() > 32767.0) {
    throw RefusedError("Betaflight stores a bias in 16 bits, but a bias of this calibration is " +
                       number_text(model.bias.cwiseAbs().maxCoeff(), 6));
  }
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, "betaflight", options);
  lines.push_back(worked_example(calibration, model));
  std::string text = comment_lines(calibration, "# ", lines, loss);
  text += sensor == Sensor::accelerometer ? "set acc_calibration = " : "set mag_calibration = ";
  for (int k = 0; k < 3; ++k) {
    text += (k > 0 ? "," : "") + number_text(model.bias(k));
  }
  text += sensor == Sensor::accelerometer ? ",1\nsave\n" : "\nsave\n";
  return {.content = text, .loss = loss};
}

}  // namespace axiscal
