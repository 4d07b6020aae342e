// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include <Eigen/Core>

#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal {

/// The world's effects on the readings of one instrument, one after another.
class WorldEffects {
 public:
  /// @param noise_sd  of each axis; must outlive it, as the world.
  WorldEffects(const World& world,
               const Eigen::VectorXd& noise_sd,
               std::uint64_t seed,
               std::uint32_t stream,
               std::size_t readings);

  /// Goes on to the next reading.
  void next(int block);

  /// The cube is laid down again.
  void lay();

  /// The table's field in the sensor, with the cube in its present position.
  [[nodiscard]] Eigen::Matrix3d as_seated(const Eigen::Matrix3d& rotation_sensor_from_table) const {
    return mount_ * rotation_sensor_from_table * seat_;
  }

  /// The factors of the field, and of each axis's sensitivities, relative to their means.
  [[nodiscard]] double size_of_field() const { return size_; }
  [[nodiscard]] const Eigen::VectorXd& gains() const { return gains_; }

  /// The addition to the response.
  /// @param random  the noise's stream; a white world takes all its numbers from this stream.
  /// @param along   of each axis, the part of the full field that lies along it; asked for where it
  ///                counts.
  [[nodiscard]] Eigen::VectorXd added(RandomStream& random,
                                      const std::function<Eigen::VectorXd()>& along);

  [[nodiscard]] const Eigen::VectorXd& bias_of_run() const { return walked_; }

 private:
  // The factor that turns a normal number into Student's, of standard deviation 1.
  double spread();

  const World& world_;
  bool has_any_;
  const Eigen::VectorXd& noise_sd_;
  RandomStream cube_;
  RandomStream own_;
  double readings_;
  double at_ = 0.0;        // number of the reading, from 1
  int block_ = 0;          // blocks count from 1
  Eigen::VectorXd noise_;  // of the reading before, in its standard deviations
  Eigen::VectorXd walk_;
  Eigen::VectorXd walked_;  // its mean over the run, so far
  Eigen::VectorXd block_bias_;
  Eigen::VectorXd gains_;
  double size_ = 1.0;
  double wander_ = 0.0;
  Eigen::Matrix3d mount_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d seat_ = Eigen::Matrix3d::Identity();
};

/// @return of each axis, the part of the full field that lies along it; m entries.
[[nodiscard]] Eigen::VectorXd parts_along(const SensorModel& truth, const Eigen::Vector3d& field);

/// The contribution of the squared and cubed field along each axis.
[[nodiscard]] Eigen::VectorXd nonlinear_part(const World& world,
                                             const SensorModel& truth,
                                             const Eigen::Vector3d& field);

/// @return the noise of m axes.
[[nodiscard]] Eigen::VectorXd noise_of_axes(const SimulationOptions& options, Eigen::Index m);

/// @return the response, rounded as the resolution and the world do.
[[nodiscard]] Eigen::VectorXd rounded(Eigen::VectorXd response, const SimulationOptions& options);

/// @throws DomainError  as simulate_run().
void check_simulation(const SensorModel& truth, const SimulationOptions& options);

}  // namespace axiscal
