// SPDX-License-Identifier: Apache-2.0
// One-sided axes: the used readings are compared with those by the truth, and the coefficients with
// a regression on these readings.
#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_setup.hpp"
#include "axiscal/positioner/design.hpp"
#include "calib/fit/estimate_by_method.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr double light_noise = 1e-4;

// Six photodiodes, one on each face of the cube. `off` is their deviation from the normals.
LinearResponse six_diodes(double off = 0.02) {
  LinearResponse truth{.bias = 0.01 * Eigen::VectorXd::LinSpaced(6, 1.0, 2.0),
                       .sensitivity = SensitivityMatrix(6, 3)};
  for (int k = 0; k < 6; ++k) {
    Eigen::Vector3d row = (k % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(k / 2);
    row += off * Eigen::Vector3d(std::sin(k + 1.0), std::cos(2.0 * k), std::sin(3.0 * k));
    truth.sensitivity.row(k) = (1.0 + 0.05 * k) * row.transpose();
  }
  return truth;
}

// A run of the 24 points at each of the levels.
struct LightRun {
  LinearResponse truth = six_diodes();
  std::vector<FieldDescription> parts;
  Experiment experiment;
  Observations observations;

  LightRun(std::vector<FieldDescription> lights,
           const std::vector<double>& levels,
           double noise_sd,
           LinearResponse response = six_diodes())
      : truth(std::move(response)), parts(std::move(lights)) {
    experiment.instrument.kind = "optical";
    experiment.instrument.axes = {"px", "nx", "py", "ny", "pz", "nz"};
    experiment.instrument.one_sided = true;
    experiment.field.of = make_field("light");
    for (const double level : levels) {
      for (const DesignEntry& entry : standard_design(24)) {
        observations.readings.push_back({.run = static_cast<int>(observations.readings.size()) + 1,
                                         .point = entry.point,
                                         .level = level});
      }
    }
    observations.response.resize(static_cast<Eigen::Index>(observations.readings.size()), 6);
    RandomStream random(1);
    for (Eigen::Index i = 0; i < observations.response.rows(); ++i) {
      for (Eigen::Index k = 0; k < 6; ++k) {
        double v = truth.bias(k) + noise_sd * random.normal();
        for (std::size_t p = 0; p < parts.size(); ++p) {
          v += factor(i, p) * std::max(0.0, truth.sensitivity.row(k).dot(light(i, p)));
        }
        observations.response(i, k) = v;
      }
    }
  }

  // light(): field of a part in the sensor at a reading. factor(): its multiple by the reading's
  // level.
  [[nodiscard]] Eigen::Vector3d light(Eigen::Index i, std::size_t part) const {
    const Reading& reading = observations.readings[static_cast<std::size_t>(i)];
    return Positioner().rotation_table_from_positioner(*reading.point).transpose() *
           *parts[part].in_table;
  }
  [[nodiscard]] double factor(Eigen::Index i, std::size_t part) const {
    return parts[part].set_by_level
               ? observations.readings[static_cast<std::size_t>(i)].level.of_all()
               : 1.0;
  }

  // @return the cosine of the angle between the sensitive direction of an axis and a light.
  [[nodiscard]] double share(Eigen::Index i, Eigen::Index k, std::size_t part) const {
    return Eigen::Vector3d(truth.sensitivity.row(k)).normalized().dot(light(i, part).normalized());
  }

  [[nodiscard]] Estimate estimate(Method method, AxisMask& seen) const {
    const ReadingSource source(experiment, observations, Weighting::none, false);
    return estimate_one_sided(method, source, parts, seen);
  }
};

FieldDescription lamp_at(const Eigen::Vector3d& direction) {
  FieldDescription lamp{.kind = "light", .unit = "1", .magnitude = 1.0};
  lamp.in_table = direction.normalized();
  lamp.start.sign_by = direction;
  return lamp;
}

const Eigen::Vector3d oblique_lamp(0.55, 0.25, 0.8);

// @return the readings that each axis should use: dark ones, and those with the light clearly in
// front.
AxisMask readings_in_front(const LightRun& run) {
  AxisMask mask(run.observations.response.rows(), 6);
  for (Eigen::Index i = 0; i < mask.rows(); ++i) {
    for (Eigen::Index k = 0; k < 6; ++k) {
      mask(i, k) = run.factor(i, 0) == 0.0 || run.share(i, k, 0) > 0.05;
    }
  }
  return mask;
}

// Bias and row of S of an axis, by QR of its used readings. `fields` are the fields that the axis
// responds to.
Eigen::Vector4d regression_of(const LightRun& run,
                              const AxisMask& counted,
                              Eigen::Index axis,
                              const Eigen::MatrixX3d& fields) {
  const auto n = static_cast<Eigen::Index>(counted.col(axis).count());
  Eigen::MatrixXd X(n, 4);
  Eigen::VectorXd v(n);
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < counted.rows(); ++i) {
    if (counted(i, axis)) {
      X.row(row) << 1.0, fields.row(i);
      v(row++) = run.observations.response(i, axis);
    }
  }
  return X.colPivHouseholderQr().solve(v);
}

Eigen::MatrixX3d lamp_fields(const LightRun& run) {
  Eigen::MatrixX3d fields(run.observations.response.rows(), 3);
  for (Eigen::Index i = 0; i < fields.rows(); ++i) {
    fields.row(i) = run.factor(i, 0) * run.light(i, 0).transpose();
  }
  return fields;
}

TEST(OneSidedAxes, UseTheReadingsWithTheLightInFront) {
  const LightRun run({lamp_at(oblique_lamp)}, {1.0, 0.0}, light_noise);
  AxisMask seen;
  const Estimate estimate = run.estimate(Method::known, seen);
  const AxisMask expected = readings_in_front(run);
  EXPECT_TRUE((seen == expected).all());
  EXPECT_FALSE(estimate.sight.unsettled);
  EXPECT_TRUE(estimate.sight.visible.empty());
  for (Eigen::Index k = 0; k < 6; ++k) {
    const Eigen::Vector4d x = regression_of(run, expected, k, lamp_fields(run));
    EXPECT_NEAR(estimate.response.bias(k), x(0), 1e-11);
    EXPECT_MATRIX_NEAR(Eigen::Vector3d(estimate.response.sensitivity.row(k)), x.tail<3>(), 1e-10);
  }
}

// Method joint fits the direction of the lamp. The start is off by 5 degrees.
TEST(OneSidedAxes, FindTheDirectionOfTheLamp) {
  LightRun run({lamp_at(oblique_lamp)}, {1.0, 0.0}, light_noise);
  run.parts[0].in_table =
      rotation_by(Eigen::Vector3d(0.06, -0.05, 0.04)) * oblique_lamp.normalized();
  AxisMask seen;
  const Estimate estimate = run.estimate(Method::joint, seen);
  EXPECT_MATRIX_NEAR(estimate.field.vector(0), oblique_lamp.normalized(), 5e-4);
  EXPECT_MATRIX_NEAR(estimate.response.sensitivity, run.truth.sensitivity, 2e-3);
  EXPECT_MATRIX_NEAR(estimate.response.bias, run.truth.bias, 5e-4);
  EXPECT_FALSE(estimate.sight.unsettled);
}

// Light at grazing incidence (cosine 0.03) is blocked by the housing. No axis uses such readings.
TEST(OneSidedAxes, LeaveGrazingLightOut) {
  LightRun run({lamp_at(Eigen::Vector3d(0.03, 0.6, 0.8))}, {1.0, 0.0}, 0.0, six_diodes(0.0));
  int grazed = 0;
  for (Eigen::Index i = 0; i < run.observations.response.rows(); ++i) {
    for (Eigen::Index k = 0; k < 6; ++k) {
      const double share = run.share(i, k, 0);
      if (run.factor(i, 0) > 0.0 && share > 0.0 && share < 0.05) {
        run.observations.response(i, k) = run.truth.bias(k);
        ++grazed;
      }
    }
  }
  EXPECT_GE(grazed, 24);
  AxisMask seen;
  const Estimate estimate = run.estimate(Method::known, seen);
  EXPECT_TRUE((seen == readings_in_front(run)).all());
  EXPECT_MATRIX_NEAR(estimate.response.sensitivity, run.truth.sensitivity, 1e-10);
}

TEST(OneSidedAxes, FollowTheUnitAndTheOrderOfReadings) {
  const LightRun run({lamp_at(oblique_lamp)}, {1.0, 0.0}, light_noise);
  LightRun other = run;
  std::reverse(other.observations.readings.begin(), other.observations.readings.end());
  other.observations.response = 50.0 * run.observations.response.colwise().reverse();
  AxisMask seen;
  AxisMask seen_other;
  const Estimate a = run.estimate(Method::joint, seen);
  const Estimate b = other.estimate(Method::joint, seen_other);
  EXPECT_TRUE((seen_other.colwise().reverse() == seen).all());
  EXPECT_MATRIX_NEAR(b.response.sensitivity, 50.0 * a.response.sensitivity, 1e-7);
  EXPECT_MATRIX_NEAR(b.response.bias, 50.0 * a.response.bias, 1e-8);
}

// The field is stated for each reading (fx, fy, fz), as by a goniometer.
TEST(OneSidedAxes, TakeFieldsThatReadingsBring) {
  LightRun run({lamp_at(oblique_lamp)}, {1.0}, 0.0);
  Observations& observations = run.observations;
  RandomStream random(3);
  const Eigen::Index n = 120;
  observations.readings.assign(static_cast<std::size_t>(n), Reading());
  observations.response.resize(n, 6);
  AxisMask expected(n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    Reading& reading = observations.readings[static_cast<std::size_t>(i)];
    reading.run = static_cast<int>(i) + 1;
    const bool dark = i % 10 == 0;
    const Eigen::Vector3d field = random.normals<3>().normalized();
    reading.field_in_sensor = dark ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : field;
    reading.level = dark ? 0.0 : 1.0;
    for (Eigen::Index k = 0; k < 6; ++k) {
      const Eigen::RowVector3d S = run.truth.sensitivity.row(k);
      const double sensed = dark ? 0.0 : std::max(0.0, S.dot(field));
      observations.response(i, k) = run.truth.bias(k) + sensed + light_noise * random.normal();
      expected(i, k) = dark || S.dot(field) > 0.05 * S.norm();
    }
  }
  const ReadingSource source(run.experiment, observations, Weighting::none, true);
  AxisMask seen;
  const Estimate estimate = estimate_one_sided(Method::known, source, run.parts, seen);
  EXPECT_LE((seen != expected).count(), 2);  // readings at the limit
  EXPECT_MATRIX_NEAR(estimate.response.sensitivity, run.truth.sensitivity, 5e-4);
  EXPECT_MATRIX_NEAR(estimate.response.bias, run.truth.bias, 5e-4);
}

// ---- a light that stays on next to the lamp ----

std::vector<FieldDescription> lamp_and_window() {
  FieldDescription window = lamp_at(Eigen::Vector3d(-0.5, 0.75, 0.3));
  window.name = "window";
  window.set_by_level = false;
  window.magnitude = 0.6;
  window.in_table = 0.6 * *window.in_table;
  FieldDescription lamp = lamp_at(oblique_lamp);
  lamp.name = "lamp";
  return {window, lamp};
}

TEST(OneSidedAxes, SeeEachLightForItself) {
  const LightRun run(lamp_and_window(), {1.0, 0.0}, light_noise);
  AxisMask seen;
  const Estimate estimate = run.estimate(Method::known, seen);
  ASSERT_EQ(estimate.sight.visible.size(), 2U);
  Eigen::Index counted = 0;
  for (Eigen::Index i = 0; i < seen.rows(); ++i) {
    for (Eigen::Index k = 0; k < 6; ++k) {
      const double window = run.share(i, k, 0);
      const double lamp = run.share(i, k, 1);
      const bool counts = std::abs(window) > 0.05 && (run.factor(i, 1) == 0.0 || lamp > 0.05);
      EXPECT_EQ(seen(i, k), counts) << i << k;
      if (seen(i, k)) {
        EXPECT_EQ(estimate.sight.visible[0](i, k), window > 0.0) << i << k;
        ++counted;
      }
    }
  }
  EXPECT_GT(counted, seen.size() / 3);
  // Compares with the regression on the light that reaches each axis.
  for (Eigen::Index k = 0; k < 6; ++k) {
    Eigen::MatrixX3d fields(seen.rows(), 3);
    for (Eigen::Index i = 0; i < seen.rows(); ++i) {
      const double window = run.share(i, k, 0) > 0.0 ? 1.0 : 0.0;
      fields.row(i) = (window * run.light(i, 0) + run.factor(i, 1) * run.light(i, 1)).transpose();
    }
    const Eigen::Vector4d x = regression_of(run, seen, k, fields);
    EXPECT_NEAR(estimate.response.bias(k), x(0), 1e-10);
    EXPECT_MATRIX_NEAR(Eigen::Vector3d(estimate.response.sensitivity.row(k)), x.tail<3>(), 1e-9);
  }
}

TEST(OneSidedAxes, FindBothLights) {
  const LightRun run(lamp_and_window(), {1.0, 0.0}, light_noise);
  AxisMask seen;
  const Estimate estimate = run.estimate(Method::joint, seen);
  EXPECT_MATRIX_NEAR(estimate.field.vector(0), *run.parts[0].in_table, 1e-3);
  EXPECT_MATRIX_NEAR(estimate.field.vector(1), *run.parts[1].in_table, 1e-3);
  EXPECT_MATRIX_NEAR(estimate.response.sensitivity, run.truth.sensitivity, 5e-3);
}

TEST(OneSidedAxes, NeedTheDarkBesideALightThatStaysOn) {
  const LightRun run(lamp_and_window(), {1.0, 0.5}, light_noise);
  AxisMask seen;
  EXPECT_THAT(
      test::complaint_of<SetupError>([&] { static_cast<void>(run.estimate(Method::known, seen)); }),
      HasSubstr("no reading was taken with the other light off (level 0)"));
}

// If the lamp is on the table's normal, the light reaches each axis from one direction only.
TEST(OneSidedAxes, NameTheCoefficientsThatStayOpen) {
  const LightRun run({lamp_at(Eigen::Vector3d::UnitZ())}, {1.0, 0.0}, light_noise, six_diodes(0.0));
  AxisMask seen;
  try {
    static_cast<void>(run.estimate(Method::known, seen));
    FAIL() << "one direction of light was accepted";
  } catch (const RankDeficientError& error) {
    EXPECT_THAT(error.undetermined(), testing::Contains("px.sensitivity.y"));
    EXPECT_THAT(error.undetermined(), testing::Not(testing::Contains("px.sensitivity.x")));
    EXPECT_THAT(error.what(), HasSubstr("d=p-n"));
  }
}

}  // namespace
}  // namespace axiscal
