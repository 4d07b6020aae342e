// SPDX-License-Identifier: Apache-2.0
#include "axiscal/formulas/kind_file.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/formulas/formula_field.hpp"
#include "formulas/src/formula.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr const char* field_mill =
    R"js({"format": "axiscal-instrument-kind", "version": 1,
  "name": "field_mill_by_file", "usual_field": "custom",
  "derived": [{"name": "zenith_angle_deg", "formula": "atan2(hypot(x, y), z) * 180 / pi"},
              {"name": "part", "formula": "sqrt(x^2 + y^2 + z^2) / F"}],
  "quantities": [{"name": "gain", "formula": "sqrt(sx^2 + sy^2 + sz^2)", "unit": "mV/(V/m)"}]})js";

TEST(KindFile, DerivesAndDescribesByItsFormulas) {
  const test::ScratchFolder folder;
  const std::string path = folder.write("mill.json", field_mill);
  const InstrumentKind& kind = add_instrument_kind_file(path);
  EXPECT_EQ(&add_instrument_kind_file(path), &kind);
  EXPECT_EQ(kind.usual_field, "custom");
  SensorModel truth = test::accelerometer_truth();
  truth.instrument.kind = std::string(kind.name);
  const Calibration result = [&] {
    Experiment experiment = test::experiment_for(truth);
    experiment.fit.method = Method::joint;
    return calibrate(experiment, test::observe(truth, {.noise_sd = 1e-3}));
  }();
  // Expected values: the angle from z, and the length of a row of S with its first-order
  // uncertainty.
  const Eigen::Vector3d field(0.3, 0.4, 0.5);
  const Eigen::Vector3d v = result.sensor.response.at(field);
  const ReducedReading reduced = Reducer(result)(std::array{v(0), v(1), v(2)});
  EXPECT_NEAR(reduced["zenith_angle_deg"], 45.0, 1e-9);
  EXPECT_NEAR(reduced["part"], field.norm() / result.sensor.field.magnitude, 1e-12);
  const std::vector<KindQuantity> quantities = quantities_of(result);
  ASSERT_EQ(quantities.size(), 3U);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::RowVector3d S = result.sensor.response.sensitivity.row(k);
    const Eigen::Matrix3d C = result.fit.statistics->covariance.block<3, 3>(4 * k + 1, 4 * k + 1);
    const KindQuantity& gain = quantities[static_cast<std::size_t>(k)];
    EXPECT_EQ(gain.of, result.sensor.instrument.axes[static_cast<std::size_t>(k)]);
    EXPECT_NEAR(gain.values[0], S.norm(), 1e-12);
    EXPECT_NEAR(gain.u[0], std::sqrt((S * C * S.transpose())(0)) / S.norm(), 1e-4 * gain.u[0]);
  }
}

TEST(KindFile, SaysWhatIsWrongWithAFormula) {
  const test::ScratchFolder folder;
  const auto complaint = [&](const std::string& formula) {
    const std::string path =
        folder.write("bad.json", R"js({"format": "axiscal-instrument-kind", "version": 1,
      "name": "bad", "derived": [{"name": "a", "formula": ")js" +
                                     formula + R"js("}]})js");
    return test::complaint_of<DataError>(
        [&] { static_cast<void>(add_instrument_kind_file(path)); });
  };
  EXPECT_THAT(complaint("x +"), HasSubstr("bad.json"));
  EXPECT_THAT(complaint("x + q"), HasSubstr("'q' is not a known variable"));
  EXPECT_THAT(complaint("foo(x)"), HasSubstr("'foo' is not a known function"));
  EXPECT_THAT(complaint("hypot(x)"), HasSubstr("needs 2 arguments, not 1"));
  EXPECT_THAT(complaint("x y"), HasSubstr("syntax error at character 3: 'y'"));
  EXPECT_THAT(complaint("x = 3"), HasSubstr("syntax error at character 3"));
  EXPECT_THAT(complaint("(x"), HasSubstr("is missing at the end"));
  EXPECT_THAT(complaint(""), HasSubstr("the formula ''"));
  EXPECT_THAT(complaint(std::string(101, '(') + "x"), HasSubstr("more than 100 parentheses"));
  EXPECT_THAT(complaint(std::string(5000, 'q')), HasSubstr("has 5000 characters"));
  const std::string taken =
      folder.write("taken.json",
                   R"js({"format": "axiscal-instrument-kind", "version": 1, "name": "optical"})js");
  EXPECT_THAT(
      test::complaint_of<DataError>([&] { static_cast<void>(add_instrument_kind_file(taken)); }),
      HasSubstr("exists already"));
}

TEST(Formula, HasThePrecedenceOfMathematics) {
  const std::vector<double> values = {2.0, 3.0, 5.0};
  const auto value = [&](const std::string& text) {
    return Formula(text, {"x", "y", "z"})(values);
  };
  EXPECT_EQ(value("-x^2"), -4.0);
  EXPECT_EQ(value("2^3^2"), 512.0);
  EXPECT_EQ(value("2^-1"), 0.5);
  EXPECT_EQ(value("x - y - z"), -6.0);
  EXPECT_EQ(value("z / x / 5 * -2"), -1.0);
  EXPECT_EQ(value("x--y"), 5.0);
  EXPECT_EQ(value("1e3 + .5"), 1000.5);
  EXPECT_EQ(value("x < 1 ? y : x == 2 ? 7 : 8"), 7.0);
  EXPECT_EQ(value("x > 1 && y > 5 || z >= 5"), 1.0);
  EXPECT_EQ(value("min(x, y, z) + max(x, y, z) + sum(x, y) + avg(x, y, z + 1)"),
            2.0 + 5.0 + 5.0 + 11.0 / 3.0);
  EXPECT_EQ(value("atan2(y, x)"), std::atan2(3.0, 2.0));
  EXPECT_EQ(value("sign(-x) * ln(_e) * cos(pi)"), 1.0);
  EXPECT_TRUE(std::isnan(value("sqrt(-x)")));
  EXPECT_EQ(value(std::string(1800, '-') + "x"), 2.0);
  EXPECT_TRUE(Formula("x + 1", {"x", "y"}).has("x"));
  EXPECT_FALSE(Formula("x + 1", {"x", "y"}).has("y"));
}

constexpr const char* turning_field =
    R"js({"format": "axiscal-experiment", "version": 1, "method": "known",
  "instrument": {"kind": "magnetometer", "unit": "uT"},
  "field": {"kind": "formula", "unit": "uT", "x": "40 * cos(t / 600)", "y": "40 * sin(t / 600)",
            "z": "20"}})js";

TEST(FormulaField, IsStatedByFilesAndMoves) {
  add_formula_field();
  add_formula_field();
  const Experiment experiment = parse_experiment(turning_field, "e.json").experiment;
  const ReferenceField& field = *experiment.field.of;
  EXPECT_TRUE(field.moves());
  EXPECT_TRUE(field.is_induced());
  EXPECT_MATRIX_NEAR(field.value_in_enu_at(300.0),
                     Eigen::Vector3d(40.0 * std::cos(0.5), 40.0 * std::sin(0.5), 20.0), 1e-12);
  const Experiment again = parse_experiment(experiment_json(experiment), "e.json").experiment;
  EXPECT_EQ(experiment_json(again), experiment_json(experiment));
  constexpr const char* unknown_number =
      R"js({"format": "axiscal-experiment", "version": 1,
    "field": {"kind": "formula", "x": "cos(u)", "y": "1", "z": "1"}})js";
  EXPECT_THAT(test::complaint_of<DataError>(
                  [] { static_cast<void>(parse_experiment(unknown_number, "e.json")); }),
              HasSubstr("/field/x"));
}

// Calibrates in a field that turns by a formula, with one reading each minute.
TEST(FormulaField, CalibratesUnderIt) {
  add_formula_field();
  const Experiment experiment = parse_experiment(turning_field, "e.json").experiment;
  const LinearResponse truth{
      .bias = Eigen::Vector3d(1.0, -2.0, 3.0),
      .sensitivity = 0.9 * Eigen::Matrix3d::Identity() + 0.01 * Eigen::Matrix3d::Ones()};
  const std::vector<RunSheetRow> sheet = make_run_sheet(standard_design(12), 1, 1);
  Observations observations;
  observations.readings = readings_of(sheet);
  observations.response.resize(static_cast<Eigen::Index>(sheet.size()), 3);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const double t = 60.0 * static_cast<double>(i);
    observations.readings[i].time_s = t;
    const Eigen::Vector3d in_table(40.0 * std::cos(t / 600.0), 40.0 * std::sin(t / 600.0), 20.0);
    observations.response.row(static_cast<Eigen::Index>(i)) = truth.at(
        Positioner().rotation_table_from_positioner(sheet[i].entry.point).transpose() * in_table);
  }
  const Calibration result = calibrate(experiment, observations);
  EXPECT_MATRIX_NEAR(result.sensor.response.bias, truth.bias, 1e-10);
  EXPECT_MATRIX_NEAR(result.sensor.response.sensitivity, truth.sensitivity, 1e-12);
}

}  // namespace
}  // namespace axiscal
