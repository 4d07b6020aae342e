// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/simulate_log.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "axiscal/calib/recording.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {
namespace {

class Recorder {
 public:
  explicit Recorder(const ImuSimulation& simulation)
      : simulation_(simulation),
        random_(simulation.seed, 3),
        up_in_table_(rotation_sloping_from_level(simulation.slope) * Eigen::Vector3d::UnitZ()) {
    log_.name = "simulated";
    log_.columns = {"t", "ax", "ay", "az"};
    if (simulation.gyroscope) {
      log_.columns.insert(log_.columns.end(), {"gx", "gy", "gz"});
    }
    if (simulation.magnetometer) {
      log_.columns.insert(log_.columns.end(), {"mx", "my", "mz"});
    }
    log_.samples.resize(log_.columns.size());
  }

  void sample(const Eigen::Matrix3d& table_from_sensor, const Eigen::Vector3d& rate, double shake) {
    std::size_t column = 0;
    log_.samples[column++].push_back(static_cast<double>(count_++) / simulation_.rate_hz);
    Eigen::Vector3d field = table_from_sensor.transpose() * up_in_table_;
    if (shake > 0.0) {
      field += shake * normals();
    }
    put(column, simulation_.accelerometer.at(field), simulation_.accelerometer_sd);
    if (simulation_.gyroscope) {
      put(column, simulation_.gyroscope->at(rate), simulation_.gyroscope_sd);
    }
    if (simulation_.magnetometer) {
      put(column,
          simulation_.magnetometer->at(table_from_sensor.transpose() *
                                       simulation_.magnetic_in_table),
          simulation_.magnetometer_sd);
    }
  }

  RecordedLog take() { return std::move(log_); }

 private:
  Eigen::Vector3d normals() { return random_.normals<3>(); }

  void put(std::size_t& column, const Eigen::Vector3d& values, double sd) {
    const Eigen::Vector3d noisy = values + sd * normals();
    for (const double value : noisy) {
      log_.samples[column++].push_back(value);
    }
  }

  const ImuSimulation& simulation_;
  RandomStream random_;
  Eigen::Vector3d up_in_table_;
  RecordedLog log_;
  std::size_t count_ = 0;
};

}  // namespace

RecordedLog simulate_imu_log(const ImuSimulation& simulation,
                             const std::vector<Eigen::Matrix3d>& rotations_table_from_sensor) {
  Recorder recorder(simulation);
  const auto samples_in = [&](double seconds) {
    return static_cast<int>(std::lround(seconds * simulation.rate_hz));
  };
  const int resting = samples_in(simulation.rest_s);
  const int turning = samples_in(simulation.turn_s);
  for (std::size_t i = 0; i < rotations_table_from_sensor.size(); ++i) {
    const Eigen::Matrix3d& here = rotations_table_from_sensor[i];
    for (int s = 0; s < resting; ++s) {
      recorder.sample(here, Eigen::Vector3d::Zero(), 0.0);
    }
    if (i + 1 == rotations_table_from_sensor.size()) {
      break;
    }
    for (int s = 1; s < turning; ++s) {
      const double part = static_cast<double>(s) / turning;
      const HandMotion motion =
          hand_motion(here, rotations_table_from_sensor[i + 1], part, simulation.turn_s);
      recorder.sample(motion.table_from_sensor, motion.rate,
                      simulation.hand_shake * std::sin(std::numbers::pi * part));
    }
  }
  return recorder.take();
}

std::vector<Eigen::Matrix3d> attitudes_of(const std::vector<RunSheetRow>& sheet) {
  std::vector<Eigen::Matrix3d> attitudes;
  for (const RunSheetRow& row : sheet) {
    attitudes.push_back(Positioner().rotation_table_from_positioner(row.entry.point));
  }
  return attitudes;
}

std::vector<Eigen::Matrix3d> random_attitudes(std::size_t count, std::uint64_t seed) {
  RandomStream random(seed, 4);
  std::vector<Eigen::Matrix3d> attitudes;
  while (attitudes.size() < count) {
    const Eigen::Vector4d wxyz = random.normals<4>();
    const Eigen::Quaterniond any(wxyz(0), wxyz(1), wxyz(2), wxyz(3));
    const Eigen::Matrix3d attitude = any.normalized().toRotationMatrix();
    if (attitudes.empty() ||
        Eigen::AngleAxisd(Eigen::Matrix3d(attitudes.back().transpose() * attitude)).angle() >
            std::numbers::pi / 3.0) {
      attitudes.push_back(attitude);
    }
  }
  return attitudes;
}

}  // namespace axiscal
