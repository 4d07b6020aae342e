// SPDX-License-Identifier: Apache-2.0
#include "axiscal/exchange/import.hpp"

#include <Eigen/LU>

#include "axiscal/core/error.hpp"
#include "axiscal/exchange/export.hpp"
#include "exchange_fixtures.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

// A record that is exported and imported reduces the same readings to the same field.
void expect_returned(const Calibration& calibration,
                     const std::string& format,
                     double reading_factor,
                     double field_factor) {
  const std::string text = export_calibration(calibration, format, {.instance = 1}).content;
  const Calibration back = import_calibration(
      text, "file", format, {.kind = calibration.sensor.instrument.kind, .instance = 1});
  for (Trial trial : trials(calibration)) {
    const Eigen::Vector3d expected = field_factor * trial.field;
    trial.reading *= reading_factor;
    EXPECT_LT((applied(back, trial) - expected).norm(), 1e-11 * expected.norm()) << format;
  }
  EXPECT_FALSE(back.fit.statistics.has_value());
  EXPECT_THAT(back.findings.notes.front().message,
              HasSubstr("imported from file (" + format + ")"));
}

TEST(Import, ReturnsWhatWasExported) {
  const Calibration accelerometer = without_cross_axis_terms(accelerometer_in("m/s^2", "m/s^2"));
  for (const char* const format : {"px4", "ardupilot"}) {
    expect_returned(accelerometer, format, 1.0, 1.0);
  }
  expect_returned(magnetometer(), "px4", 0.01, 0.01);
  expect_returned(magnetometer(), "ardupilot", 10.0, 10.0);
  expect_returned(accelerometer_in("m/s^2", "m/s^2"), "kalibr", 1.0, 1.0);
  expect_returned(gyroscope(), "kalibr", 1.0, 1.0);
}

// imucal's formula is f = R^-1 K^-1 (v - b).
TEST(Import, ReadsImucal) {
  const char* const text = R"({"cal_type": "Ferraris", "acc_unit": "m/s^2", "gyr_unit": "deg/s",
"from_acc_unit": "a.u.", "from_gyr_unit": "a.u.", "comment": null,
"K_a": [[200.0, 0, 0], [0, 210.0, 0], [0, 0, 190.0]],
"R_a": [[1.0, 0.01, 0], [0, 1.0, 0.02], [-0.03, 0, 1.0]], "b_a": [10.0, -20.0, 30.0],
"K_g": [[16.0, 0, 0], [0, 16.5, 0], [0, 0, 17.0]],
"R_g": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "K_ga": [[0, 0, 0], [0, 0, 0], [0.1, 0, 0]],
"b_g": [1.0, 2.0, 3.0]})";
  const Calibration acc = import_calibration(text, "cal.json", "imucal");
  EXPECT_EQ(acc.sensor.instrument.unit, "a.u.");
  EXPECT_EQ(acc.sensor.field.magnitude, 9.80665);
  EXPECT_DOUBLE_EQ(acc.sensor.response.sensitivity(0, 1), 2.0);
  EXPECT_DOUBLE_EQ(acc.sensor.response.sensitivity(2, 0), -5.7);
  const Calibration gyr = import_calibration(text, "cal.json", "imucal", {.kind = "gyroscope"});
  EXPECT_EQ(gyr.sensor.field.unit, "deg/s");
  EXPECT_EQ(gyr.sensor.response.bias, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_THAT(gyr.findings.notes.back().message, HasSubstr("K_ga"));
}

void expect_bad(const std::string& text,
                const std::string& format,
                const std::string& why,
                const ImportOptions& options = {}) {
  try {
    static_cast<void>(import_calibration(text, "their.file", format, options));
    ADD_FAILURE() << "was taken: " << text;
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("their.file:"));
    EXPECT_THAT(error.what(), HasSubstr(why));
  }
}

TEST(Import, SaysWhatIsWrongAndWhere) {
  expect_bad("# empty\n", "px4", "has no CAL_ACC0_XOFF");
  expect_bad("1\t1\tCAL_ACC0_XOFF\tabc\t9\n", "px4",
             "their.file:1: this line does not contain the name of a parameter");
  expect_bad("1\t1\tCAL_ACC0_XOFF\t1\t9\n", "px4", "CAL_ACC0_YOFF");
  // A missing value, a cut file, and a parameter that appears twice.
  expect_bad("1\t1\tCAL_ACC0_XOFF\t9\n", "px4",
             "their.file:1: this line does not contain the name of a parameter");
  expect_bad("1\t1\tCAL_ACC0_XOFF\t1.\t9\n1\t1\tCAL_ACC0_YOFF\t1.", "px4", "their.file:2:");
  expect_bad("1\t1\tCAL_ACC0_XOFF\t1\t9\n1\t1\tCAL_ACC0_XOFF\t2\t9\n", "px4", "occurs twice");
  expect_bad(
      "INS_ACCOFFS_X,0\nINS_ACCOFFS_Y,0\nINS_ACCOFFS_Z,0\n"
      "INS_ACCSCAL_X,0\nINS_ACCSCAL_Y,1\nINS_ACCSCAL_Z,1\n",
      "ardupilot", "cannot be inverted");
  expect_bad("{}", "imucal", "not a calibration file of imucal");
  expect_bad("{", "imucal", "not a calibration file of imucal");
  expect_bad(R"({"K_a": [[1,2],[3,4]], "R_a": 1, "b_a": []})", "imucal", "/K_a:");
  expect_bad("imu0: [1, 2", "kalibr", "not valid YAML");
  expect_bad("imu0:\n  accelerometers:\n    M: 3\n", "kalibr", "M: three rows");
  expect_bad("imu0: {}\n", "kalibr", "does not contain imu0 with accelerometers");
  expect_bad("imu0:\n  accelerometers: 5\n", "kalibr", "does not contain imu0 with accelerometers");
  EXPECT_THROW(static_cast<void>(import_calibration("", "f", "kalib")), DomainError);
  EXPECT_THROW(static_cast<void>(import_calibration("", "f", "px4", {.kind = "optical"})),
               DomainError);
}

// Values that are not finite numbers are refused.
TEST(Import, TakesFiniteNumbersOnly) {
  const std::string kalibr = "imu0:\n  accelerometers:\n    M: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n";
  for (const char* const bias : {".nan", ".inf", "-.inf", "1e999"}) {
    expect_bad(kalibr + "    bias: [0, " + bias + ", 0]\n", "kalibr", "bias: ");
  }
  expect_bad("imu0:\n  accelerometers:\n    M: [[1, 0, 0], [0, .nan, 0], [0, 0, 1]]\n", "kalibr",
             "their.file:3: M: must be a finite number");
  const std::string offsets =
      "1\t1\tCAL_ACC0_XOFF\t0\t9\n1\t1\tCAL_ACC0_YOFF\t0\t9\n1\t1\tCAL_ACC0_ZOFF\t0\t9\n";
  const auto scales = [](const std::string& one) {
    std::string text;
    for (const char* const axis : {"X", "Y", "Z"}) {
      text += std::string("1\t1\tCAL_ACC0_") + axis + "SCALE\t" + one + "\t9\n";
    }
    return text;
  };
  for (const char* const scale : {"1e200", "1e-200", "0"}) {
    expect_bad(offsets + scales(scale), "px4", "cannot be inverted");
  }
  expect_bad(offsets + scales("1e999"), "px4", "does not contain the name of a parameter");
  // A record that could not be read is not imported. Gravity must be in g or m/s^2.
  expect_bad(R"({"acc_unit": "foot", "K_a": [[1,0,0],[0,1,0],[0,0,1]],
                 "R_a": [[1,0,0],[0,1,0],[0,0,1]], "b_a": [0,0,0]})",
             "imucal", "unit must be g or m/s^2 for gravity", {.magnitude = 32.0});
}

// ArduPilot reads a diagonal of 0 as 1, and multiplies by COMPASS_SCALE if it is not 0.
TEST(Import, ArduPilotsCompassWithoutADiagonal) {
  const Calibration back = import_calibration(
      "COMPASS_OFS_X,10\nCOMPASS_OFS_Y,-20\nCOMPASS_OFS_Z,30\n"
      "COMPASS_DIA_X,0\nCOMPASS_DIA_Y,0\nCOMPASS_DIA_Z,0\nCOMPASS_SCALE,1.25\n",
      "f", "ardupilot", {.kind = "magnetometer"});
  EXPECT_EQ(back.sensor.response.bias, Eigen::Vector3d(-10.0, 20.0, -30.0));
  EXPECT_LT((Eigen::Matrix3d(back.sensor.response.sensitivity) - 0.8 * Eigen::Matrix3d::Identity())
                .norm(),
            1e-15);
}

}  // namespace
}  // namespace axiscal::test
