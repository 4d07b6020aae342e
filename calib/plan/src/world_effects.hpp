// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include <Eigen/Core>

#include "axiscal/calib/simulate.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal {

/// Draws the random errors of a World for consecutive readings of one instrument.
class WorldEffects {
 public:
  /// @param world     must outlive this object.
  /// @param noise_sd  standard deviation of each axis's noise; must outlive this object.
  WorldEffects(const World& world,
               const Eigen::VectorXd& noise_sd,
               std::uint64_t seed,
               std::uint32_t stream,
               std::size_t readings);

  /// Draws the errors that belong to the next reading. Must be called before each reading.
  void next(int block);

  /// Draws a new random rotation of the cube relative to the table. Must be called each time the
  /// cube is placed on the table.
  void lay();

  /// @return the rotation from table to sensor, including the current random rotations of the
  ///         instrument in the cube and of the cube on the table.
  [[nodiscard]] Eigen::Matrix3d as_seated(const Eigen::Matrix3d& rotation_sensor_from_table) const {
    return mount_ * rotation_sensor_from_table * seat_;
  }

  /// @return the factor that multiplies the field's magnitude in the current reading; its mean is
  ///         1.
  [[nodiscard]] double size_of_field() const { return size_; }

  /// @return for each axis, the factor that multiplies its sensitivities in the current reading.
  ///         Each factor has the mean 1.
  [[nodiscard]] const Eigen::VectorXd& gains() const { return gains_; }

  /// Draws the errors to add to the response, m entries [unit].
  /// @param random  the random stream of the noise. If the only error is white, normal noise, no
  ///                other stream is used.
  /// @param along   returns parts_along() of the reading; called only if World::ends is used.
  [[nodiscard]] Eigen::VectorXd added(RandomStream& random,
                                      const std::function<Eigen::VectorXd()>& along);

  [[nodiscard]] const Eigen::VectorXd& bias_of_run() const { return walked_; }

 private:
  // Draws a random factor. A normal number times this factor has Student's distribution with
  // standard deviation 1.
  double spread();

  const World& world_;
  bool has_any_;
  const Eigen::VectorXd& noise_sd_;
  RandomStream cube_;
  RandomStream own_;
  double readings_;
  double at_ = 0.0;        // number of the reading, from 1
  int block_ = 0;          // number of the block, from 1
  Eigen::VectorXd noise_;  // noise of the previous reading, in units of its standard deviation
  Eigen::VectorXd walk_;
  Eigen::VectorXd walked_;  // sum of walk_ up to the current reading, divided by readings_
  Eigen::VectorXd block_bias_;
  Eigen::VectorXd gains_;
  double size_ = 1.0;
  double wander_ = 0.0;
  Eigen::Matrix3d mount_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d seat_ = Eigen::Matrix3d::Identity();
};

/// @return the component of the field along each axis, divided by the field's magnitude; m entries.
[[nodiscard]] Eigen::VectorXd parts_along(const SensorModel& truth, const Eigen::Vector3d& field);

/// @return the response to the squared and cubed field component along each axis, m entries [unit].
[[nodiscard]] Eigen::VectorXd nonlinear_part(const World& world,
                                             const SensorModel& truth,
                                             const Eigen::Vector3d& field);

/// @return the standard deviation of the noise of each of the m axes [unit].
[[nodiscard]] Eigen::VectorXd noise_of_axes(const SimulationOptions& options, Eigen::Index m);

/// @return the response, rounded to multiples of options.resolution and of World::round.
[[nodiscard]] Eigen::VectorXd rounded(Eigen::VectorXd response, const SimulationOptions& options);

/// @throws DomainError  as simulate_run().
void check_simulation(const SensorModel& truth, const SimulationOptions& options);

}  // namespace axiscal
