// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/world.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/positioner/design.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

struct AXISCAL_EXPORT SimulationOptions {
  double noise_sd = 0.0;      ///< standard deviation of the noise of a reading [unit]
  Eigen::VectorXd noise_sds;  ///< one standard deviation for each axis; if empty, noise_sd is used
  World world;                ///< other errors of the readings
  /// Slope of the table, in addition to the slope that the truth's field contains.
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  /// Azimuth of the fence. The field of the truth is stated for azimuth 0.
  double fence_azimuth_rad = 0.0;
  Positioner positioner;  ///< the cube
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  double temperature_sd = 0.0;  ///< scatter of the true temperature about the planned one
  double resolution = 0.0;      ///< rounding step of the readings [unit]; 0: no rounding
  std::uint64_t seed = 1;       ///< seed of the random numbers
  std::uint32_t stream = 0;     ///< number of the random stream; different for each instrument
};

/// Removes the slope of the table from all fields whose source is not on the table. The slope is
/// found from gravity in the table's frame or, if there is none, from the turntable's axis.
/// @return the truth on a level table. If the fields do not determine the slope, the truth is
///         unchanged.
[[nodiscard]] AXISCAL_EXPORT SensorModel on_level_table(SensorModel truth);

/// @return the truth with field.in_table. If the record lacks this vector, for example after method
///         magnitude, it is set to the field of the record's site on a level table with the fence
///         to the north. If the record has no site, the truth is returned unchanged.
[[nodiscard]] AXISCAL_EXPORT SensorModel with_field_of_site(SensorModel truth);

/// A simulated run.
struct SimulatedRun {
  Observations observations;
  /// The mean of the bias's random walk over the run, m entries [unit]. A calibration cannot
  /// separate this mean from the bias.
  Eigen::VectorXd bias_of_run;
};

/// Simulates the readings of a sensor with a known response: v_i = b + S R_sp R_i f_table + noise.
/// R_sp is the mount, and R_i is the rotation from the table to the cube.
///
/// The field in the table is field.in_table of the truth. If this is nullopt, the field has the
/// magnitude of the truth's field and is along the table's normal. The field is then tilted by the
/// slope (x, y): (0, 0, 1) becomes (x, y, sqrt(1 - x^2 - y^2)). Therefore the result of a
/// calibration can be used as the truth. In a sum of fields, parts whose source is on the table are
/// not tilted.
/// One-sided axes do not respond to light from behind.
///
/// @param truth  the true instrument, field and response, for example from a calibration.
/// @param sheet  the design points in the order in which they are taken.
/// @return the readings; the same seed gives the same numbers.
/// @throws DomainError  if the noise is negative or not finite, if the slope is 1 or more, or if a
///                      member of the World has numbers for a different number of axes.
/// @par Source
/// method.md, sections 2, 3 and 8.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_run(const SensorModel& truth,
                                                       const std::vector<RunSheetRow>& sheet,
                                                       const SimulationOptions& options = {});

/// Like the overload without a stream, but takes the noise from the given random stream. If
/// stream_of_noise() made the stream, the results are equal. RandomStream::seed_several() seeds
/// several streams faster.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_run(const SensorModel& truth,
                                                       const std::vector<RunSheetRow>& sheet,
                                                       const SimulationOptions& options,
                                                       RandomStream& random);
[[nodiscard]] AXISCAL_EXPORT RandomStream stream_of_noise(const SimulationOptions& options);

/// @return only the observations of simulate_run().
[[nodiscard]] AXISCAL_EXPORT Observations simulate(const SensorModel& truth,
                                                   const std::vector<RunSheetRow>& sheet,
                                                   const SimulationOptions& options = {});

}  // namespace axiscal
