// SPDX-License-Identifier: Apache-2.0
#include "mistakes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/positioner/design.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

Eigen::Vector3d field_of(const SensorModel& truth, const DesignPoint& point) {
  return Positioner().rotation_table_from_positioner(point).transpose() * *truth.field.in_table;
}

// @return the noise of reading i: the response less the true response at its point.
Eigen::VectorXd noise_in(const SensorModel& truth, const Observations& good, std::size_t i) {
  return Eigen::VectorXd(good.response.row(static_cast<Eigen::Index>(i))) -
         truth.response.at(field_of(truth, *good.readings[i].point));
}

// Replaces reading i by the reading at another point, with the same noise and label.
void take_at(const SensorModel& truth,
             const DesignPoint& point,
             std::size_t i,
             Observations& observations) {
  observations.response.row(static_cast<Eigen::Index>(i)) =
      truth.response.at(field_of(truth, point)) + noise_in(truth, observations, i);
}

Eigen::Vector3d random_direction(RandomStream& random) {
  return random.normals<3>().normalized();
}

}  // namespace

const char* name_of(Mistake mistake) {
  constexpr std::array names = {"none",         "wrong face",  "upside down", "wrong way round",
                                "exchanged",    "columns",     "sign",        "unit factor",
                                "exact repeat", "tilted seat", "table moved", "drift",
                                "saturation"};
  return names[static_cast<std::size_t>(mistake)];
}

RandomRun random_run(const Eigen::Vector3d& noise, RandomStream& random, int replicates) {
  RandomRun run;
  LinearResponse response;
  response.bias = Eigen::VectorXd(3);
  response.sensitivity.resize(3, 3);
  for (Eigen::Index k = 0; k < 3; ++k) {
    response.bias(k) = 0.02 * random.normal();
    for (Eigen::Index j = 0; j < 3; ++j) {
      response.sensitivity(k, j) = (k == j ? 1.0 : 0.0) + 0.02 * random.normal();
    }
  }
  run.truth = truth_of(response, "accelerometer");
  run.truth.field.kind = "gravity";
  run.truth.field.unit = "g";
  const double angle = 2.0 * std::numbers::pi * random.uniform();
  constexpr double slope = 5e-3;
  const double x = slope * std::cos(angle);
  const double y = slope * std::sin(angle);
  run.truth.field.in_table = Eigen::Vector3d(x, y, std::sqrt(1.0 - x * x - y * y));
  const std::uint64_t seed = random.index(1U << 30U);
  run.good = simulate(run.truth, make_run_sheet(standard_design(12), replicates, seed));
  for (Eigen::Index i = 0; i < run.good.response.rows(); ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      run.good.response(i, k) += noise(k) * random.normal();
    }
  }
  return run;
}

SeededMistake move_reading(const Eigen::Vector3d& size,
                           const Observations& good,
                           RandomStream& random) {
  SeededMistake seeded{.observations = good};
  const std::size_t i = random.index(static_cast<std::size_t>(good.size()));
  seeded.observations.response.row(static_cast<Eigen::Index>(i)) +=
      size.cwiseProduct(random_direction(random)).transpose();
  seeded.runs = {good.readings[i].run};
  seeded.codes = {WarningCode::outlier, WarningCode::tilted_seat};
  return seeded;
}

SeededMistake seed_mistake(Mistake mistake,
                           double size,
                           const SensorModel& truth,
                           const Observations& good,
                           RandomStream& random) {
  SeededMistake seeded{.observations = good};
  Observations& observations = seeded.observations;
  const auto n = static_cast<std::size_t>(good.size());
  const std::size_t i = random.index(n);
  const auto row = static_cast<Eigen::Index>(i);
  const DesignPoint stated = *good.readings[i].point;
  seeded.runs = {good.readings[i].run};
  const auto other_than = [&](std::size_t count, std::size_t not_this) {
    const std::size_t j = random.index(count - 1);
    return j < not_this ? j : j + 1;
  };
  switch (mistake) {
    case Mistake::none:
      seeded.runs.clear();
      break;
    case Mistake::wrong_face: {
      const std::vector<DesignEntry> all = standard_design(24);
      DesignPoint point = stated;
      while (axis_of(point.rest()) == axis_of(stated.rest())) {
        point = all[random.index(all.size())].point;
      }
      take_at(truth, point, i, observations);
      seeded.codes = {WarningCode::wrong_pose};
      break;
    }
    case Mistake::upside_down:
      take_at(truth, {face_of(axis_of(stated.rest()), !is_positive(stated.rest())), stated.fence()},
              i, observations);
      seeded.codes = {WarningCode::wrong_pose};
      break;
    case Mistake::wrong_way_round:
      take_at(truth, stated.turned_round(), i, observations);
      seeded.codes = {WarningCode::wrong_pose};
      break;
    case Mistake::exchanged: {
      const std::size_t j = other_than(n, i);
      observations.response.row(row) = good.response.row(static_cast<Eigen::Index>(j));
      observations.response.row(static_cast<Eigen::Index>(j)) = good.response.row(row);
      seeded.runs = {std::min(good.readings[i].run, good.readings[j].run),
                     std::max(good.readings[i].run, good.readings[j].run)};
      seeded.codes = {WarningCode::exchanged};
      break;
    }
    case Mistake::columns: {
      const auto a = static_cast<Eigen::Index>(random.index(3));
      const Eigen::Index b = (a + 1) % 3;
      std::swap(observations.response(row, a), observations.response(row, b));
      seeded.codes = {WarningCode::columns_exchanged};
      break;
    }
    case Mistake::sign: {
      const auto a = static_cast<Eigen::Index>(random.index(3));
      observations.response(row, a) *= -1.0;
      seeded.codes = {WarningCode::sign};
      break;
    }
    case Mistake::unit_factor: {
      constexpr std::array<double, 4> factors = {1e3, 1e-3, 9.80665, 1.0 / 9.80665};
      observations.response.row(row) *= factors[random.index(4)];
      seeded.codes = {WarningCode::unit_factor};
      break;
    }
    case Mistake::repeat: {
      const std::size_t j = other_than(n, i);
      observations.response.row(row) = good.response.row(static_cast<Eigen::Index>(j));
      seeded.codes = {WarningCode::stuck};
      break;
    }
    case Mistake::tilt: {
      const Eigen::Vector3d field = field_of(truth, stated);
      const Eigen::Vector3d axis = field.cross(random_direction(random)).normalized();
      observations.response.row(row) += truth.response.sensitivity * (size * axis.cross(field));
      seeded.codes = {WarningCode::tilted_seat};
      break;
    }
    case Mistake::table_moved: {
      const std::size_t cut = 1 + random.index(n - 1);
      const double angle = 2.0 * std::numbers::pi * random.uniform();
      SensorModel moved = truth;
      const Eigen::Matrix3d turn =
          rotation_by(size * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0));
      moved.field.in_table = Eigen::Vector3d(turn * *truth.field.in_table);
      for (std::size_t j = cut; j < n; ++j) {
        const DesignPoint& point = *good.readings[j].point;
        observations.response.row(static_cast<Eigen::Index>(j)) +=
            truth.response.sensitivity * (field_of(moved, point) - field_of(truth, point));
      }
      seeded.runs.clear();
      seeded.codes = {WarningCode::table_moved};
      break;
    }
    case Mistake::drift: {
      const Eigen::Vector3d change = size * random_direction(random);
      for (std::size_t j = 0; j < n; ++j) {
        const double along = static_cast<double>(j) / static_cast<double>(n - 1);
        observations.response.row(static_cast<Eigen::Index>(j)) += along * change;
      }
      seeded.runs.clear();
      seeded.codes = {WarningCode::drift};
      break;
    }
    case Mistake::saturation: {
      const auto axis = static_cast<Eigen::Index>(random.index(3));
      // Clips the axis so that the two largest readings are lower by at least `size`.
      Eigen::VectorXd sorted = good.response.col(axis);
      std::sort(sorted.begin(), sorted.end());
      const double most = sorted(sorted.size() - 2) - size;
      for (Eigen::Index j = 0; j < observations.response.rows(); ++j) {
        observations.response(j, axis) = std::min(observations.response(j, axis), most);
      }
      seeded.runs.clear();
      seeded.codes = {WarningCode::saturated};
      break;
    }
  }
  return seeded;
}

Verdict judge(const Calibration& calibration, const SeededMistake& mistake) {
  Verdict verdict{.caught = !calibration.findings.warnings.empty()};
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    const bool code =
        std::find(mistake.codes.begin(), mistake.codes.end(), warning.code) != mistake.codes.end();
    const bool runs = mistake.runs.empty() || warning.runs == mistake.runs;
    verdict.named = verdict.named || (code && runs);
  }
  return verdict;
}

}  // namespace axiscal::test
