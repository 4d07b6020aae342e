// SPDX-License-Identifier: Apache-2.0
// Formats kalibr, ros and x-io: files of robotics software.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <Eigen/QR>
#include <nlohmann/json.hpp>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "core/formatted.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

std::string yaml_row(const Eigen::RowVector3d& row) {
  return formatted("[{}, {}, {}]", number_text(row(0)), number_text(row(1)), number_text(row(2)));
}

std::string yaml_matrix(const Eigen::Matrix3d& M, const std::string& indent) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text += formatted("{}- {}\n", indent, yaml_row(M.row(i)));
  }
  return text;
}

// The factors of a sensitivity matrix S = M C. M is lower triangular with a positive diagonal; C is
// a rotation.
struct ScaleMisalignment {
  Eigen::Matrix3d M;
  Eigen::Matrix3d C;
};

ScaleMisalignment scale_misalignment(const Eigen::Matrix3d& S) {
  if (S.determinant() < 0.0) {
    throw RefusedError(
        "Kalibr's M C cannot describe left-handed axes: an axis of this instrument is reversed; "
        "change its sign in the readings and calibrate again");
  }
  const Eigen::HouseholderQR<Eigen::Matrix3d> qr(S.transpose());
  const Eigen::Matrix3d R = qr.matrixQR().triangularView<Eigen::Upper>();
  const Eigen::Matrix3d Q = qr.householderQ();
  const Eigen::Vector3d signs =
      R.diagonal().unaryExpr([](double d) { return d < 0.0 ? -1.0 : 1.0; });
  return {.M = R.transpose() * signs.asDiagonal(), .C = signs.asDiagonal() * Q.transpose()};
}

// The parameters of one sensor in a file of Kalibr.
struct KalibrSensor {
  Sensor sensor = Sensor::none;
  ScaleMisalignment split;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();  // for a gyroscope: sensitivity to specific force
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  std::optional<ExportLoss> loss;
  std::string comment;
};

KalibrSensor kalibr_sensor(const Calibration& calibration, const ExportOptions& options) {
  KalibrSensor result{.sensor = sensor_of(calibration, "kalibr")};
  if (result.sensor == Sensor::magnetometer) {
    throw RefusedError("Kalibr's imu.yaml does not support magnetometers");
  }
  const bool is_gyroscope = result.sensor == Sensor::gyroscope;
  const std::string unit = usual_unit(result.sensor, "");
  ConsumerModel model = nearest_model(calibration, {unit, unit}, MatrixShape::full, options);
  const auto also =
      std::find_if(calibration.sensor.also.begin(), calibration.sensor.also.end(),
                   [](const AlsoResponse& one) { return field_kind(one.kind).vertical; });
  model.has_also = is_gyroscope && also != calibration.sensor.also.end();
  result.loss = accepted_loss(calibration, model, "kalibr", options);
  result.split = scale_misalignment(model.inverse.inverse());
  result.bias = model.bias;
  if (model.has_also) {
    const double per_unit = also->unit == "g" ? 1.0 / standard_gravity : 1.0;
    // Kalibr rotates the specific force into the frame of the gyroscope before it multiplies by A.
    result.A = model.reading_factor * per_unit * also->sensitivity * result.split.C.transpose();
  }
  result.comment = comment_lines(
      calibration, "# ",
      {formatted("{}, in {}; M is lower triangular, C a rotation",
                 is_gyroscope ? "v = M C w + A C a + bias" : "v = M C f + bias", unit),
       is_gyroscope ? "a: specific force in m/s^2, in the frame of the gyroscope"
                    : "Kalibr assumes that C of the accelerometer is the identity: the IMU's frame "
                      "in Kalibr is this instrument's frame rotated by C",
       "axiscal adds bias and the C of an accelerometer; Kalibr itself does not write these "
       "entries",
       "the command 'axiscal noise' writes the noise densities and random walks",
       worked_example(calibration, model)},
      result.loss);
  return result;
}

// Returns the YAML block of one sensor.
// @param frame  rotation from the instrument's frame to the IMU's frame. This is the matrix C of
//               the accelerometer if the file also contains an accelerometer, otherwise the
//               identity.
std::string kalibr_block(const KalibrSensor& one, const Eigen::Matrix3d& frame) {
  const bool is_gyroscope = one.sensor == Sensor::gyroscope;
  std::string text = is_gyroscope ? "  gyroscopes:\n" : "  accelerometers:\n";
  text += "    M:\n" + yaml_matrix(one.split.M, "    ");
  text += is_gyroscope ? "    C_gyro_i:\n" + yaml_matrix(one.split.C * frame.transpose(), "    ")
                       : "    C:\n" + yaml_matrix(one.split.C, "    ");
  if (is_gyroscope) {
    text += "    A:\n" + yaml_matrix(one.A, "    ");
  }
  return text + formatted("    bias: {}\n", yaml_row(one.bias.transpose()));
}

std::string kalibr_head(int instance) {
  return formatted("imu{}:\n  model: scale-misalignment\n", instance);
}

}  // namespace

Exported export_kalibr(const Calibration& calibration, const ExportOptions& options) {
  const KalibrSensor one = kalibr_sensor(calibration, options);
  return {.content = one.comment + kalibr_head(options.instance) +
                     kalibr_block(one, Eigen::Matrix3d::Identity()),
          .loss = one.loss,
          .notes = {}};
}

Exported export_kalibr_imu(const Calibration& first,
                           const Calibration& second,
                           const ExportOptions& options) {
  KalibrSensor accelerometer = kalibr_sensor(first, options);
  KalibrSensor gyroscope = kalibr_sensor(second, options);
  if (accelerometer.sensor == Sensor::gyroscope) {
    std::swap(accelerometer, gyroscope);
  }
  if (accelerometer.sensor == gyroscope.sensor) {
    throw RefusedError(
        "kalibr: an IMU is one accelerometer and one gyroscope, but both "
        "records have the same kind");
  }
  if (!first.sensor.instrument.serial.empty() && !second.sensor.instrument.serial.empty() &&
      first.sensor.instrument.serial != second.sensor.instrument.serial) {
    throw RefusedError(formatted("kalibr: the records have different serial numbers, '{}' and '{}'",
                                 first.sensor.instrument.serial, second.sensor.instrument.serial));
  }
  Exported exported{.content = accelerometer.comment + gyroscope.comment +
                               "# C_gyro_i: from the accelerometer's frame, as in Kalibr\n" +
                               kalibr_head(options.instance) +
                               kalibr_block(accelerometer, Eigen::Matrix3d::Identity()) +
                               kalibr_block(gyroscope, accelerometer.split.C),
                    .loss = accelerometer.loss,
                    .notes = {}};
  if (gyroscope.loss) {
    exported.notes.push_back("not stored for the gyroscope: " + loss_text(*gyroscope.loss));
  }
  return exported;
}

namespace {

// Returns the covariance of a calibrated reading, for the ROS messages sensor_msgs/Imu and
// sensor_msgs/MagneticField. It is computed from the standard deviations of the residuals.
std::string covariance_for_ros(const Calibration& calibration,
                               const ConsumerModel& model,
                               Sensor sensor,
                               const std::string& unit) {
  if (!calibration.fit.statistics || calibration.fit.statistics->residual_sd.size() != 3) {
    return "";
  }
  Eigen::Matrix3d variance = Eigen::Matrix3d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double sd = model.reading_factor * calibration.fit.statistics->residual_sd(k);
    variance(k, k) = std::isfinite(sd) ? sd * sd : 0.0;
  }
  const Eigen::Matrix3d C = model.inverse * variance * model.inverse.transpose();
  std::string entries;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      entries += (entries.empty() ? "" : ", ") + number_text(0.5 * (C(i, j) + C(j, i)), 6);
    }
  }
  const char* const name = sensor == Sensor::accelerometer ? "linear_acceleration_covariance"
                           : sensor == Sensor::gyroscope   ? "angular_velocity_covariance"
                                                           : "magnetic_field_covariance";
  return formatted(
      "# covariance of the readings of the calibration [({})^2]; the covariance of one sample is "
      "larger: see the command 'axiscal noise'\n{}: [{}]\n",
      unit, name, entries);
}

}  // namespace

Exported export_ros(const Calibration& calibration, const ExportOptions& options) {
  const Sensor sensor = sensor_of(calibration, "ros");
  const std::string unit = usual_unit(sensor, "T");
  const std::string readings = options.reading_factor ? unit : calibration.sensor.instrument.unit;
  const ConsumerModel model = nearest_model(calibration, {options.reading_factor ? unit : "", unit},
                                            MatrixShape::full, options);
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, "ros", options);
  std::string text = comment_lines(calibration, "# ",
                                   {formatted("field [{}] = SM v - bias, v in {}; SM row by row; "
                                              "imu_calib itself applies this formula only to "
                                              "accelerometers",
                                              unit, readings),
                                    worked_example(calibration, model)},
                                   loss);
  std::string entries;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      entries += (entries.empty() ? "" : ", ") + number_text(model.inverse(i, j));
    }
  }
  text += formatted("SM: [{}]\nbias: {}\n", entries,
                    yaml_row((model.inverse * model.bias).transpose()));
  text += covariance_for_ros(calibration, model, sensor, unit);
  return {.content = text, .loss = loss};
}

Exported export_x_io(const Calibration& calibration, const ExportOptions& options) {
  const Sensor sensor = sensor_of(calibration, "x-io");
  const std::string unit = sensor == Sensor::accelerometer ? "g"
                           : sensor == Sensor::gyroscope   ? "deg/s"
                                                           : calibration.sensor.field.unit;
  const ConsumerModel model = nearest_model(calibration, {"", unit}, MatrixShape::full, options);
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, "x-io", options);
  using Json = nlohmann::ordered_json;
  const auto row_major = [](const Eigen::Matrix3d& M) {
    Json values = Json::array();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        values.push_back(M(i, j));
      }
    }
    return values;
  };
  const auto vector = [](const Eigen::Vector3d& v) { return Json{v(0), v(1), v(2)}; };
  Json json;
  std::string formula;
  if (sensor == Sensor::magnetometer) {
    formula = formatted(
        "field [{}] = softIronMatrix (v - hardIronOffset), as in Fusion since 2022; earlier "
        "versions and the x-IMU3 use softIronMatrix v - h, so enter h = softIronMatrix "
        "hardIronOffset there",
        unit);
    json["softIronMatrix"] = row_major(model.inverse);
    json["hardIronOffset"] = vector(model.bias);
  } else {
    formula = formatted("field [{}] = misalignment diag(sensitivity) (v - offset)", unit);
    // The lengths of the matrix columns are the sensitivities. The normalised columns are the
    // misalignment.
    const Eigen::Vector3d lengths = model.inverse.colwise().norm().transpose();
    const std::string name = sensor == Sensor::accelerometer ? "accelerometer" : "gyroscope";
    json[name + "Misalignment"] = row_major(model.inverse * lengths.cwiseInverse().asDiagonal());
    json[name + "Sensitivity"] = vector(lengths);
    json[name + "Offset"] = vector(model.bias);
  }
  // JSON does not allow comments, so the comment becomes a member.
  const Json comment = comment_of(
      calibration,
      {formatted("{}, v in {}, matrices row by row", formula, calibration.sensor.instrument.unit)},
      loss);
  json["comment"] = comment;
  return {.content = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n", .loss = loss};
}

}  // namespace axiscal
