// SPDX-License-Identifier: Apache-2.0
// Each export is evaluated by its reader's formula and compared with apply.
#include "axiscal/exchange/export.hpp"

#include <cstdlib>
#include <functional>
#include <map>

#include <Eigen/LU>

#include "axiscal/exchange/settings.hpp"
#ifdef AXISCAL_MATIO
#include <matio.h>
#endif
#include <nlohmann/json.hpp>
#ifdef AXISCAL_PUGIXML
#include <pugixml.hpp>
#endif

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "exchange_fixtures.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

using Formula = std::function<Eigen::Vector3d(const Eigen::Vector3d& reading)>;

// Expects that the reader's field [its unit] is the field of apply [unit of the record] times
// `field_factor`.
void expect_replayed(const Calibration& calibration,
                     const Formula& formula,
                     double field_factor,
                     double tolerance) {
  for (const Trial& trial : trials(calibration)) {
    const Eigen::Vector3d expected = field_factor * applied(calibration, trial);
    EXPECT_LT((formula(trial.reading) - expected).norm(), tolerance * expected.norm());
  }
}

// @return the numbers of a parameter file whose lines are "NAME<separator>...VALUE".
std::map<std::string, double> parameters_of(const std::string& text,
                                            char separator,
                                            std::size_t name_at,
                                            std::size_t value_at) {
  std::map<std::string, double> all;
  for (const std::string_view line : split(text, '\n')) {
    if (!line.empty() && line.front() != '#') {
      const std::vector<std::string_view> parts = split(line, separator);
      all[std::string(parts.at(name_at))] = parse_number(parts.at(value_at)).value();
    }
  }
  return all;
}

Eigen::Vector3d xyz(const std::map<std::string, double>& all,
                    const std::string& prefix,
                    const std::string& suffix = "") {
  return {all.at(prefix + "X" + suffix), all.at(prefix + "Y" + suffix),
          all.at(prefix + "Z" + suffix)};
}

Eigen::Matrix3d with_diagonals(const Eigen::Vector3d& diagonal, const Eigen::Vector3d& off) {
  return Eigen::Matrix3d({{diagonal(0), off(0), off(1)},
                          {off(0), diagonal(1), off(2)},
                          {off(1), off(2), diagonal(2)}});
}

TEST(ExportPx4, IsTheSameByPx4sFormula) {
  const Calibration accelerometer = without_cross_axis_terms(accelerometer_in("m/s^2", "g"));
  const auto acc =
      parameters_of(export_calibration(accelerometer, "px4", {.instance = 1}).content, '\t', 2, 3);
  expect_replayed(
      accelerometer,
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return (v - xyz(acc, "CAL_ACC1_", "OFF")).cwiseProduct(xyz(acc, "CAL_ACC1_", "SCALE"));
      },
      9.81, 1e-12);
  const auto mag = parameters_of(export_calibration(magnetometer(), "px4").content, '\t', 2, 3);
  expect_replayed(
      magnetometer(),
      [&](const Eigen::Vector3d& uT) -> Eigen::Vector3d {
        return with_diagonals(xyz(mag, "CAL_MAG0_", "SCALE"), xyz(mag, "CAL_MAG0_", "ODIAG")) *
               (0.01 * uT - xyz(mag, "CAL_MAG0_", "OFF"));
      },
      0.01, 1e-12);
  Calibration plain = gyroscope();
  plain.sensor.response.sensitivity = Eigen::Matrix3d::Identity();
  const auto gyr = parameters_of(export_calibration(plain, "px4").content, '\t', 2, 3);
  expect_replayed(
      plain,
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return v - xyz(gyr, "CAL_GYRO0_", "OFF");
      },
      1.0, 1e-12);
}

TEST(ExportArduPilot, IsTheSameByArduPilotsFormula) {
  const Calibration accelerometer = without_cross_axis_terms(accelerometer_in("g", "m/s^2"));
  const auto acc = parameters_of(
      export_calibration(accelerometer, "ardupilot", {.instance = 1}).content, ',', 0, 1);
  expect_replayed(
      accelerometer,
      [&](const Eigen::Vector3d& g) -> Eigen::Vector3d {
        return (9.80665 * g - xyz(acc, "INS_ACC2OFFS_")).cwiseProduct(xyz(acc, "INS_ACC2SCAL_"));
      },
      1.0, 1e-12);
  const auto mag =
      parameters_of(export_calibration(magnetometer(), "ardupilot").content, ',', 0, 1);
  expect_replayed(
      magnetometer(),
      [&](const Eigen::Vector3d& uT) -> Eigen::Vector3d {
        return with_diagonals(xyz(mag, "COMPASS_DIA_"), xyz(mag, "COMPASS_ODI_")) *
               (10.0 * uT + xyz(mag, "COMPASS_OFS_"));
      },
      10.0, 1e-12);
}

TEST(ExportArduPilot, NamesLaterSensorsAsItDoes) {
  const Calibration accelerometer = without_cross_axis_terms(accelerometer_in("m/s^2", "m/s^2"));
  EXPECT_THAT(export_calibration(accelerometer, "ardupilot", {.instance = 3}).content,
              HasSubstr("\nINS4_ACCOFFS_X,0.1\n"));
  EXPECT_THAT(export_calibration(magnetometer(), "ardupilot", {.instance = 1}).content,
              HasSubstr("\nCOMPASS_SCALE2,0\n"));
  EXPECT_THROW(static_cast<void>(export_calibration(magnetometer(), "ardupilot", {.instance = 3})),
               RefusedError);
  EXPECT_THROW(static_cast<void>(export_calibration(accelerometer, "px4", {.instance = 4})),
               RefusedError);
}

TEST(ExportRos, IsTheSameByImuCalibsFormula) {
  const Calibration calibration = accelerometer_in("LSB", "g");
  const std::string text = export_calibration(calibration, "ros").content;
  const auto numbers = [&](const std::string& key) {
    const std::size_t at = text.find("\n" + key + ": [") + key.size() + 4;
    return parse_numbers(text.substr(at, text.find(']', at) - at)).value();
  };
  const std::vector<double> SM = numbers("SM");
  const std::vector<double> bias = numbers("bias");
  ASSERT_EQ(SM.size(), 9U);
  expect_replayed(
      calibration,
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(SM.data()) * v -
               Eigen::Map<const Eigen::Vector3d>(bias.data());
      },
      9.81, 1e-12);
}

Eigen::Matrix3d rows_of(const nlohmann::json& nine) {
  const auto values = nine.get<std::vector<double>>();
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
}

Eigen::Vector3d vector_of(const nlohmann::json& three) {
  const auto values = three.get<std::vector<double>>();
  return Eigen::Map<const Eigen::Vector3d>(values.data());
}

TEST(ExportXIo, IsTheSameByFusionsFormula) {
  const auto accelerometer = accelerometer_in("LSB", "g");
  const auto acc = nlohmann::json::parse(export_calibration(accelerometer, "x-io").content);
  expect_replayed(
      accelerometer,
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return rows_of(acc["accelerometerMisalignment"]) *
               (v - vector_of(acc["accelerometerOffset"]))
                   .cwiseProduct(vector_of(acc["accelerometerSensitivity"]));
      },
      1.0, 1e-12);
  const auto gyr = nlohmann::json::parse(export_calibration(gyroscope(), "x-io").content);
  expect_replayed(
      gyroscope(),
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return rows_of(gyr["gyroscopeMisalignment"]) *
               (v - vector_of(gyr["gyroscopeOffset"]))
                   .cwiseProduct(vector_of(gyr["gyroscopeSensitivity"]));
      },
      deg_per_rad, 1e-12);
  const auto mag = nlohmann::json::parse(export_calibration(magnetometer(), "x-io").content);
  expect_replayed(
      magnetometer(),
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return rows_of(mag["softIronMatrix"]) * (v - vector_of(mag["hardIronOffset"]));
      },
      1.0, 1e-12);
}

// @return the 3 x 3 matrix of a key in Kalibr's YAML.
Eigen::Matrix3d yaml_matrix(const std::string& text, const std::string& key) {
  std::size_t at = text.find("    " + key + ":\n");
  Eigen::Matrix3d M;
  for (int i = 0; i < 3; ++i) {
    at = text.find('[', at) + 1;
    const std::vector<double> row = parse_numbers(text.substr(at, text.find(']', at) - at)).value();
    M.row(i) = Eigen::Map<const Eigen::RowVector3d>(row.data());
  }
  return M;
}

TEST(ExportKalibr, IsTheSameByKalibrsFormula) {
  for (const Calibration& calibration : {accelerometer_in("g", "m/s^2"), gyroscope()}) {
    const double factor = calibration.sensor.instrument.unit == "g" ? 9.80665 : 1.0;
    const std::string text = export_calibration(calibration, "kalibr").content;
    const Eigen::Matrix3d M = yaml_matrix(text, "M");
    const Eigen::Matrix3d C =
        yaml_matrix(text, calibration.sensor.instrument.kind == "gyroscope" ? "C_gyro_i" : "C");
    EXPECT_EQ(M(0, 1), 0.0);
    EXPECT_EQ(M(0, 2), 0.0);
    EXPECT_EQ(M(1, 2), 0.0);
    EXPECT_LT((C * C.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(C.determinant(), 1.0, 1e-14);
    const std::size_t at = text.find("bias: [") + 7;
    const std::vector<double> b = parse_numbers(text.substr(at, text.find(']', at) - at)).value();
    for (const Trial& trial : trials(calibration)) {
      const Eigen::Vector3d v = M * C * trial.field + Eigen::Map<const Eigen::Vector3d>(b.data());
      EXPECT_LT((v - factor * trial.reading).norm(), 1e-12 * v.norm());
    }
  }
}

TEST(ExportKalibr, HoldsAGyroscopesAnswerToGravity) {
  Calibration calibration = gyroscope();
  AlsoResponse gravity{.kind = "gravity", .unit = "g"};
  gravity.sensitivity =
      9.80665e-3 * Eigen::Matrix3d({{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}, {7.0, 8.0, 9.0}});
  calibration.sensor.also.push_back(gravity);
  EXPECT_THAT(export_calibration(calibration, "kalibr").content, HasSubstr("A C a"));
  // A C is the record's sensitivity to gravity.
  const std::string text = export_calibration(calibration, "kalibr").content;
  const Eigen::Matrix3d expected({{1e-3, 2e-3, 3e-3}, {4e-3, 5e-3, 6e-3}, {7e-3, 8e-3, 9e-3}});
  EXPECT_LT((yaml_matrix(text, "A") * yaml_matrix(text, "C_gyro_i") - expected).norm(), 1e-15);
  EXPECT_THROW(static_cast<void>(export_calibration(calibration, "x-io")), RefusedError);
}

// With two records Kalibr's frame is that of the accelerometer.
TEST(ExportKalibr, PutsTwoRecordsIntoOneFrame) {
  const Calibration accelerometer = accelerometer_in("m/s^2", "m/s^2");
  const Calibration gyro = gyroscope();
  const std::string text = export_imu(gyro, accelerometer, "kalibr").content;
  EXPECT_EQ(text.find("imu0:"), text.rfind("imu0:"));
  EXPECT_LT(text.find("  accelerometers:"), text.find("  gyroscopes:"));
  const auto matrix_of = [](const std::string& yaml, const std::string& key) {
    Eigen::Matrix3d M;
    std::size_t at = yaml.find("    " + key + ":\n");
    for (Eigen::Index i = 0; i < 3; ++i) {
      at = yaml.find('[', at) + 1;
      for (Eigen::Index j = 0; j < 3; ++j) {
        M(i, j) = std::stod(yaml.substr(at));
        at = yaml.find_first_of(",]", at) + 1;
      }
    }
    return M;
  };
  // The rate in the IMU's frame is turned by C to the sensor's frame. If the gyroscope is alone,
  // its frame is that of the IMU.
  const Eigen::Matrix3d in_sensor =
      matrix_of(export_calibration(gyro, "kalibr").content, "C_gyro_i");
  const Eigen::Matrix3d in_imu = matrix_of(text, "C_gyro_i");
  EXPECT_LT((in_imu * matrix_of(text, "C") - in_sensor).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_THROW(static_cast<void>(export_imu(gyro, gyro, "kalibr")), RefusedError);
  EXPECT_THROW(static_cast<void>(export_imu(gyro, accelerometer, "ros")), RefusedError);
}

TEST(ExportBetaflight, IsAnOffsetInCounts) {
  Calibration calibration = accelerometer_in("LSB", "g");
  calibration.sensor.response.bias = Eigen::Vector3d(31.0, -12.0, 250.0);
  calibration.sensor.response.sensitivity = 2048.0 * Eigen::Matrix3d::Identity();
  const Exported exported = export_calibration(calibration, "betaflight");
  EXPECT_FALSE(exported.loss.has_value());
  EXPECT_THAT(exported.content, HasSubstr("\nset acc_calibration = 31,-12,250,1\n"));
  EXPECT_THAT(exported.content, HasSubstr("acc_1G of this sensor is 2048"));
  // An error of 1 % in the scale is lost, which is 0.01 g in every direction.
  calibration.sensor.response.sensitivity *= 1.01;
  EXPECT_THROW(static_cast<void>(export_calibration(calibration, "betaflight")), RefusedError);
  const auto loss = export_calibration(calibration, "betaflight", {.lossy = true}).loss;
  ASSERT_TRUE(loss.has_value());
  EXPECT_EQ(loss->what, std::vector<std::string>{"sensitivities"});
  EXPECT_NEAR(loss->worst, 0.01, 1e-9);
  EXPECT_NEAR(loss->rms, 0.01, 1e-9);
  EXPECT_NEAR(loss->worst_deg, 0.0, 1e-6);
}

// Without the cross-axis term of 0.01, f_x is wrong by 0.01 f_y and the direction by up to 0.01
// rad.
TEST(ExportLoss, IsThatOfTheMissingTerm) {
  Calibration calibration = accelerometer_in("m/s^2", "m/s^2");
  calibration.sensor.response.sensitivity = Eigen::Matrix3d::Identity();
  calibration.sensor.response.sensitivity(0, 1) = 0.01;
  const Exported exported = export_calibration(calibration, "px4", {.lossy = true});
  ASSERT_TRUE(exported.loss.has_value());
  EXPECT_EQ(exported.loss->what, std::vector<std::string>{"cross-axis terms"});
  EXPECT_NEAR(exported.loss->worst, 0.0981, 1e-4);
  EXPECT_NEAR(exported.loss->rms, 0.0981 / std::sqrt(3.0), 1e-4);
  EXPECT_NEAR(exported.loss->worst_deg, 0.01 * deg_per_rad, 1e-3);
  EXPECT_THAT(exported.content, HasSubstr("Not stored: cross-axis terms"));
  try {
    static_cast<void>(export_calibration(calibration, "px4"));
    FAIL() << "not refused";
  } catch (const RefusedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("up to 0.0981 m/s^2 and 0.573 degrees"));
  }
}

TEST(ExportLoss, OfTemperatureIsOverTheCalibratedRange) {
  Calibration calibration =
      over_temperature(without_cross_axis_terms(accelerometer_in("m/s^2", "m/s^2")));
  calibration.sensor.temperature->scale.setZero();
  calibration.sensor.temperature->bias.setZero();
  calibration.sensor.temperature->bias(2, 0) = 1e-3;                      // at -10: 0.035 m/s^2
  EXPECT_FALSE(export_calibration(calibration, "px4").loss.has_value());  // TC_A0_.. have it
  const auto loss = export_calibration(calibration, "betaflight",
                                       {.lossy = true, .reading_factor = 2048.0 / 9.80665})
                        .loss;
  ASSERT_TRUE(loss.has_value());
  EXPECT_THAT(loss->what, testing::Contains("temperature"));
  // At -10 degrees more is lost than at the reference temperature.
  calibration.sensor.temperature->bias(2, 0) = 0.0;
  const auto without = export_calibration(calibration, "betaflight",
                                          {.lossy = true, .reading_factor = 2048.0 / 9.80665})
                           .loss;
  EXPECT_GT(loss->worst, without->worst + 0.02);
}

TEST(Export, RefusesWhatNobodyCouldUse) {
  const auto refused = [](const Calibration& calibration, const std::string& format,
                          const std::string& why, const std::vector<Setting>& settings = {}) {
    try {
      static_cast<void>(export_calibration(calibration, format));
      ADD_FAILURE() << format << " was not refused";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(why));
      EXPECT_EQ(error.settings(), settings);
    }
  };
  refused(accelerometer_in("LSB", "m/s^2"), "px4", "m/s^2 that the driver outputs for 1 LSB",
          {settings::reading_factor});
  Calibration no_gravity = accelerometer_in("m/s^2", "g");
  no_gravity.sensor.field.local_gravity.reset();
  const Exported by_standard = export_calibration(no_gravity, "px4", {.lossy = true});
  ASSERT_EQ(by_standard.notes.size(), 1U);
  EXPECT_THAT(by_standard.notes.front(), HasSubstr("standard gravity, 9.80665 m/s^2"));
  EXPECT_THAT(by_standard.content, HasSubstr("# 1 g is taken as standard gravity, 9.80665 m/s^2"));
  refused(magnetometer(), "kalibr", "does not support magnetometers");
  refused(gyroscope(), "betaflight", "at each start");
  refused(gyroscope(), "px44", "did you mean 'px4'?");
  Calibration light = magnetometer();
  light.sensor.instrument.kind = "optical";
  refused(light, "ardupilot", "does not support this instrument");
  Calibration two = accelerometer_in("V", "g");
  two.sensor.instrument.axes = {"x", "y"};
  refused(two, "c-header", "three axes");
  Calibration mirrored = accelerometer_in("m/s^2", "m/s^2");
  mirrored.sensor.response.sensitivity.row(1) *= -1.0;
  refused(mirrored, "kalibr", "change its sign");
  EXPECT_THROW(static_cast<void>(export_calibration(gyroscope(), "c-header", {.name = "a b"})),
               DomainError);
}

TEST(Export, ReadingFactorAndGravityStandIn) {
  Calibration counts = without_cross_axis_terms(accelerometer_in("LSB", "g"));
  counts.sensor.field.local_gravity.reset();
  counts.sensor.response.sensitivity *= 1670.0;
  const auto acc = parameters_of(
      export_calibration(counts, "px4", {.reading_factor = 9.80665 / 1670.0, .local_gravity = 9.81})
          .content,
      '\t', 2, 3);
  expect_replayed(
      counts,
      [&](const Eigen::Vector3d& v) -> Eigen::Vector3d {
        return (9.80665 / 1670.0 * v - xyz(acc, "CAL_ACC0_", "OFF"))
            .cwiseProduct(xyz(acc, "CAL_ACC0_", "SCALE"));
      },
      9.81, 1e-12);
}

// ---- headers: compiled and run ----

// Compiles a program with a header and runs it: readings in, fields out.
class Header : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static bool is_cpp() { return std::string(GetParam()) == "cpp-header"; }

  std::vector<Eigen::Vector3d> run(const Calibration& calibration,
                                   const ExportOptions& options,
                                   const std::string& body,
                                   const std::string& checks = "") {
    const std::string header = is_cpp() ? "imu.hpp" : "imu.h";
    folder_.write(header, export_calibration(calibration, GetParam(), options).content);
    std::string code =
        "#include \"" + header + "\"\n#include <stdio.h>\n" + checks + "int main(void) {\n";
    if (is_cpp()) {
      code += "using imu::apply;\n";
    }
    code += body + "return 0;\n}\n";
    const std::string source = folder_.write(is_cpp() ? "main.cpp" : "main.c", code);
    const std::string compiler = is_cpp() ? "c++ -std=c++17" : "cc -std=c99";
    const std::string command = "cd '" + folder_.path("") + "' && " + compiler +
                                " -O1 -pedantic -Wall -Wextra -Werror -o main '" + source +
                                "' > errors.txt 2>&1 && ./main > out.txt";
    EXPECT_EQ(std::system(command.c_str()), 0) << read_file(folder_.path("errors.txt")) << code;
    std::vector<Eigen::Vector3d> fields;
    const std::string printed = read_file(folder_.path("out.txt"));
    for (const std::string_view line : split(printed, '\n')) {
      if (!line.empty()) {
        const std::vector<double> row = parse_numbers(line).value();
        fields.emplace_back(row.at(0), row.at(1), row.at(2));
      }
    }
    return fields;
  }

  static std::string call(const std::string& arguments) {
    return (is_cpp() ? "apply(" : "imu_apply(") + arguments + ");\n";
  }

  // A program that applies the header to every trial and prints the fields.
  static std::string body_for(const std::vector<Trial>& all,
                              const std::string& type,
                              bool temperature,
                              double scale = 0.0) {
    std::string body = type + " field[3];\n";
    for (const Trial& trial : all) {
      std::string values;
      for (int k = 0; k < 3; ++k) {
        values +=
            (k > 0 ? ", " : "") + (scale > 0.0 ? number_text(std::round(scale * trial.reading(k)))
                                               : "(" + type + ")" + number_text(trial.reading(k)));
      }
      body += "{ const " + type + " v[3] = {" + values + "};\n";
      body += call(temperature ? "v, (" + type + ")" + number_text(trial.temperature) + ", field"
                               : "v, field");
      body +=
          R"(printf("%.17g,%.17g,%.17g\n", (double)field[0], (double)field[1], (double)field[2]); })";
      body += "\n";
    }
    return body;
  }

  void SetUp() override {
    if (std::system("cc --version > /dev/null 2>&1 && c++ --version > /dev/null 2>&1") != 0) {
      GTEST_SKIP() << "no compilers cc and c++ in the path";
    }
  }

  ScratchFolder folder_;
};

TEST_P(Header, DoubleAppliesWithTemperature) {
  const Calibration calibration = over_temperature(accelerometer_in("V", "g"));
  const std::vector<Trial> all = trials(calibration);
  const auto fields = run(calibration, {.name = "imu"}, body_for(all, "double", true));
  ASSERT_EQ(fields.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_LT((fields[i] - applied(calibration, all[i])).norm(), 1e-13);
  }
}

TEST_P(Header, FloatAppliesToItsPrecision) {
  const Calibration calibration = accelerometer_in("V", "g");
  const std::vector<Trial> all = trials(calibration);
  const auto fields = run(calibration, {.numbers = parse_header_numbers("float"), .name = "imu"},
                          body_for(all, "float", false));
  ASSERT_EQ(fields.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_LT((fields[i] - applied(calibration, all[i])).norm(), 1e-6);
  }
}

// The input is 16-bit counts, and the output is the field with 16 binary places.
TEST_P(Header, FixedPointAppliesToOneBit) {
  Calibration calibration = accelerometer_in("LSB", "g");
  calibration.sensor.response.bias *= 1000.3;
  calibration.sensor.response.sensitivity *= 16384.0;
  std::vector<Trial> all = trials(calibration);
  for (Trial& trial : all) {
    trial.reading = trial.reading.array().round();
  }
  const auto fields = run(calibration, {.numbers = parse_header_numbers("q0:16"), .name = "imu"},
                          body_for(all, "int32_t", false, 1.0));
  ASSERT_EQ(fields.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_LT((fields[i] / 65536.0 - applied(calibration, all[i])).cwiseAbs().maxCoeff(),
              1.01 / 65536.0);
  }
}

INSTANTIATE_TEST_SUITE_P(InEachLanguage, Header, testing::Values("c-header", "cpp-header"));

TEST(CppHeader, IsConstexpr) {
  if (std::system("c++ --version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no compiler c++ in the path";
  }
  const ScratchFolder folder;
  Calibration calibration = accelerometer_in("V", "g");
  calibration.sensor.response.bias.setConstant(1.0);
  calibration.sensor.response.sensitivity = 2.0 * Eigen::Matrix3d::Identity();
  folder.write("imu.hpp", export_calibration(calibration, "cpp-header", {.name = "imu"}).content);
  folder.write("main.cpp", R"(#include "imu.hpp"
constexpr double x_at(double v) {
  const double readings[3] = {v, 0.0, 0.0};
  double field[3] = {};
  imu::apply(readings, field);
  return field[0];
}
static_assert(x_at(3.0) == 1.0);
int main() {}
)");
  EXPECT_EQ(std::system(("c++ -std=c++17 -fsyntax-only '" + folder.path("main.cpp") + "'").c_str()),
            0);
}

TEST(CHeader, ASerialNumberStaysWithinItsComment) {
  Calibration calibration = accelerometer_in("V", "g");
  calibration.sensor.instrument.serial = "*/ int evil; /*\n#error\\";
  const std::string text = export_calibration(calibration, "c-header").content;
  EXPECT_EQ(text.find("*/"), text.find(" */\n#ifndef") + 1);
  EXPECT_EQ(text.find("\n#error"), std::string::npos);
}

TEST(HeaderNumbers, AreRead) {
  EXPECT_EQ(parse_header_numbers("q16").reading_bits, 16);
  EXPECT_EQ(parse_header_numbers("q0:20").field_bits, 20);
  for (const char* const text : {"q", "q30", "q1:2:3", "int", "q-1"}) {
    EXPECT_THROW(static_cast<void>(parse_header_numbers(text)), DomainError) << text;
  }
}

// ---- tables ----

TEST(ExportCsv, HasEveryCoefficient) {
  Calibration calibration = over_temperature(accelerometer_in("V", "g"));
  calibration.sensor.instrument.unit = "V, rms";
  const std::string text = export_calibration(calibration, "csv").content;
  EXPECT_THAT(text, HasSubstr("parameter,value,standard_error,u,U,k,unit\nx.bias,0.1,"));
  EXPECT_THAT(text, HasSubstr("\nz.sensitivity.y,0.01,"));
  EXPECT_THAT(text, HasSubstr("\ny.scale.d2,2e-06,1e-07,"));
}

#ifdef AXISCAL_MATIO
TEST(ExportMatlab, IsReadByMatio) {
  const ScratchFolder folder;
  const Calibration calibration = over_temperature(accelerometer_in("V", "g"));
  const std::string path =
      folder.write("cal.mat", export_calibration(calibration, "matlab").content);
  mat_t* const file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
  ASSERT_NE(file, nullptr);
  matvar_t* const S = Mat_VarRead(file, "sensitivity");
  ASSERT_NE(S, nullptr);
  EXPECT_EQ(S->dims[0] * S->dims[1], 9U);
  EXPECT_EQ(static_cast<const double*>(S->data)[3], 0.02);  // column-major order
  matvar_t* const unit = Mat_VarRead(file, "unit");
  ASSERT_NE(unit, nullptr);
  EXPECT_EQ(static_cast<const char*>(unit->data)[0], 'V');
  Mat_VarFree(S);
  Mat_VarFree(unit);
  Mat_Close(file);
}
#endif

TEST(ExportNumpy, IsReadByNumpy) {
  if (std::system("/usr/bin/python3 -c 'import numpy' > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no numpy";
  }
  const ScratchFolder folder;
  const Calibration calibration = over_temperature(accelerometer_in("V", "g"));
  folder.write("cal.npz", export_calibration(calibration, "numpy").content);
  folder.write("check.py", R"(import numpy as np
c = np.load('cal.npz')
assert c['bias'].shape == (3,) and c['sensitivity'].shape == (3, 3)
assert c['sensitivity'][0, 1] == 0.02 and c['sensitivity'][1, 0] == 0.015
assert np.allclose(c['inverse'] @ c['sensitivity'], np.eye(3), atol=1e-14)
assert c['temperature_bias'].shape == (3, 2) and c['temperature_bias'][2, 1] == -3e-5
assert c['unit'][()] == b'V' and c['serial'][()] == b'A-17'
)");
  EXPECT_EQ(std::system(("cd '" + folder.path("") + "' && /usr/bin/python3 check.py").c_str()), 0);
  EXPECT_EQ(export_calibration(calibration, "numpy").content,
            read_file(folder.path("cal.npz")));  // reproducible
}

// ---- certificates ----

#ifdef AXISCAL_PUGIXML
Calibration with_uncertainty() {
  const SensorModel truth = accelerometer_truth();
  Calibration made =
      calibrate(experiment_for(truth), observe(truth, {.replicates = 2, .noise_sd = 1e-4}));
  made.sensor.instrument.serial = "<A&17>";
  return made;
}

CertificateDetails laboratory() {
  return {.number = "2026-7",
          .laboratory = {.name = "Windkanal", .address = {"Bonn"}},
          .customer = {.name = "Aero & Co", .address = {"Bedford"}},
          .country = "DE",
          .issued = "2026-11-21",
          .authorised = {{"A. B.", "head"}}};
}

TEST(ExportDcc, HoldsEveryCoefficientWithItsUncertainty) {
  const Calibration calibration = with_uncertainty();
  const std::string xml =
      export_calibration(calibration, "dcc", {.laboratory = laboratory()}).content;
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(xml.c_str()));
  const pugi::xml_node root = document.child("dcc:digitalCalibrationCertificate");
  EXPECT_STREQ(root.attribute("schemaVersion").value(), "3.2.1");
  EXPECT_STREQ(
      root.first_element_by_path("dcc:administrativeData/dcc:items/dcc:item/dcc:identifications/"
                                 "dcc:identification/dcc:value")
          .text()
          .get(),
      "<A&17>");
  EXPECT_STREQ(
      root.first_element_by_path("dcc:administrativeData/dcc:customer/dcc:name/dcc:content")
          .text()
          .get(),
      "Aero & Co");
  const std::vector<ParameterUncertainty> expected = parameter_uncertainties(calibration);
  const pugi::xml_node list = root.first_element_by_path(
      "dcc:measurementResults/dcc:measurementResult/dcc:results/dcc:result/dcc:data/dcc:list");
  std::size_t i = 0;
  for (const pugi::xml_node quantity : list.children("dcc:quantity")) {
    ASSERT_LT(i, expected.size());
    const pugi::xml_node real = quantity.child("si:real");
    EXPECT_EQ(real.child("si:value").text().as_double(), expected[i].value);
    EXPECT_EQ(real.first_element_by_path("si:expandedUnc/si:uncertainty").text().as_double(),
              expected[i].uncertainty.expanded);
    const std::string unit = real.child("si:unit").text().get();
    // The readings are in V and the field in g. D-SI has no unit g.
    EXPECT_EQ(unit, expected[i].name.find(".bias") != std::string::npos ? "\\volt" : "\\one");
    ++i;
  }
  EXPECT_EQ(i, expected.size());
  const char* const schema = std::getenv("AXISCAL_DCC_XSD");
  if (schema != nullptr) {
    const ScratchFolder folder;
    const std::string path = folder.write("dcc.xml", xml);
    EXPECT_EQ(
        std::system(
            ("xmllint --noout --schema '" + std::string(schema) + "' '" + path + "'").c_str()),
        0);
  }
}

// Text that the schema would refuse is refused with a message, or corrected if its meaning does not
// change.
TEST(ExportDcc, IsValidWhateverWasTyped) {
  CertificateDetails typed = laboratory();
  typed.number = " 2026-7 ";
  typed.manufacturer = "A\x01\x1f";
  typed.model = "  ";
  typed.condition = "good";
  const std::string xml =
      export_calibration(with_uncertainty(), "dcc", {.laboratory = typed}).content;
  EXPECT_THAT(xml, HasSubstr("<dcc:uniqueIdentifier>2026-7</dcc:uniqueIdentifier>"));
  EXPECT_THAT(xml, HasSubstr("<dcc:content>A</dcc:content>"));
  EXPECT_THAT(xml, Not(HasSubstr("dcc:model")));
  EXPECT_THAT(xml, HasSubstr("Condition of the item: good"));
  typed.country = "de";
  typed.received = "21.11.2026";
  typed.customer.address.clear();
  EXPECT_THAT(
      [&] {
        static_cast<void>(export_calibration(with_uncertainty(), "dcc", {.laboratory = typed}));
      },
      testing::ThrowsMessage<RefusedError>(
          HasSubstr("country (two letters), customer's address, received (such as 2026-11-21)")));
}

TEST(ExportDcc, NeedsALaboratory) {
  try {
    static_cast<void>(export_calibration(with_uncertainty(), "dcc"));
    FAIL() << "was made";
  } catch (const RefusedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("number, country (two letters), laboratory's name"));
  }
  EXPECT_THROW(static_cast<void>(export_calibration(accelerometer_in("V", "g"), "dcc",
                                                    {.laboratory = laboratory()})),
               RefusedError);
}
#endif

#ifdef AXISCAL_XLSXWRITER
// Expects that the sheet, recomputed by gnumeric, agrees with apply.
void expect_sheet_agrees(const Calibration& calibration) {
  if (std::system("command -v ssconvert >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "gnumeric's ssconvert is not here";
  }
  const ScratchFolder folder;
  const std::string book =
      folder.write("cal.xlsx", export_calibration(calibration, "xlsx").content);
  const std::string command = "cd '" + folder.path("") +
                              "' && ssconvert --recalc -S -O 'separator=, format=raw' '" + book +
                              "' 'sheet_%n.txt' >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::vector<std::vector<std::string>> rows =
      csv_cells(read_file(folder.path("sheet_1.txt")));
  const auto place_of = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(rows[0].begin(), rows[0].end(), name) -
                                    rows[0].begin());
  };
  const Reducer reducer(calibration);
  const std::size_t m = calibration.sensor.instrument.axes.size();
  for (std::size_t row = 1; row <= 12; ++row) {
    const auto number = [&](std::size_t at) { return std::stod(rows.at(row).at(at)); };
    std::vector<double> v;
    for (std::size_t k = 0; k < m; ++k) {
      v.push_back(number(k));
    }
    ReadingContext context;
    if (calibration.sensor.temperature) {
      const bool own = calibration.sensor.temperature->has_own_sensors();
      context.temperature = own ? SensorTemperature({number(m), number(m + 1), number(m + 2)})
                                : SensorTemperature(number(m));
    }
    if (m < 3) {
      const double expected = reducer.reduce_axis(0, v[0], context.temperature).component;
      EXPECT_NEAR(number(place_of("component_x")), expected, 1e-12 * std::abs(expected) + 1e-15);
      continue;
    }
    const ReducedReading reading = reducer.reduce(v, context);
    for (const char* const name : {"x", "y", "z"}) {
      EXPECT_NEAR(number(place_of(std::string("field_") + name)), reading[name],
                  1e-12 * reducer.magnitude());
    }
    for (std::size_t i = 0; i < reading.derived_names.size(); ++i) {
      const std::string& cell = rows[row].at(place_of(std::string(reading.derived_names[i])));
      const double expected = reading.derived.values[i];
      ASSERT_EQ(cell.empty(), std::isnan(expected)) << cell << " " << expected;
      if (!cell.empty()) {
        EXPECT_NEAR(std::stod(cell), expected, 1e-12 * 360.0) << reading.derived_names[i];
      }
    }
  }
}

TEST(ExportXlsx, ComputesAsApplyDoes) {
  expect_sheet_agrees(accelerometer_in("V", "g"));
}

TEST(ExportXlsx, ComputesOverTemperatures) {
  expect_sheet_agrees(over_temperature(accelerometer_in("V", "g")));
  Calibration own = over_temperature(accelerometer_in("V", "g"));
  const TemperatureSpan span = own.sensor.temperature->spans.front();
  own.sensor.temperature->spans = {span, {.reference = 24.0, .low = -9.0, .high = 59.0}, span};
  own.sensor.instrument.convention = AxisConvention::forward_right_down;
  expect_sheet_agrees(own);
}

TEST(ExportXlsx, RefusesWhatNoSheetReduces) {
  Calibration calibration = accelerometer_in("V", "g");
  calibration.sensor.instrument.one_sided = true;
  EXPECT_THROW(static_cast<void>(export_calibration(calibration, "xlsx")), RefusedError);
}
#endif

// The records for test benches state the outcome, the limits and the values of the record.
TEST(ExportForTestBenches, StatesOutcomeAndLimits) {
  Calibration calibration = accelerometer_in("V", "g");
  calibration.findings.verdict =
      Verdict{.passed = false,
              .rule = "simple",
              .limits = {{.parameter = "x.bias", .value = 0.5, .high = 0.1, .passed = false}},
              .not_counted = {}};
  const auto openhtf = nlohmann::json::parse(export_calibration(calibration, "openhtf").content);
  EXPECT_EQ(openhtf["dut_id"], calibration.sensor.instrument.serial);
  EXPECT_EQ(openhtf["outcome"], "FAIL");
  EXPECT_EQ(openhtf["phases"][0]["measurements"]["x.bias"]["validators"][0], "x <= 0.1");
  const auto tofupilot =
      nlohmann::json::parse(export_calibration(calibration, "tofupilot").content);
  EXPECT_EQ(tofupilot["run_passed"], false);
  EXPECT_EQ(tofupilot["steps"][0]["limit_high"], 0.1);
  EXPECT_TRUE(tofupilot["steps"][0]["limit_low"].is_null());
}

}  // namespace
}  // namespace axiscal::test
