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
  double noise_sd = 0.0;      ///< standard deviation of a reading [unit of the readings]
  Eigen::VectorXd noise_sds;  ///< one for each axis, in place of noise_sd; may be empty
  World world;                ///< other errors of the readings
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< further slope of the table
  double fence_azimuth_rad = 0.0;  ///< azimuth of the fence; the truth has its field at azimuth 0
  Positioner positioner;           ///< the cube
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  double temperature_sd = 0.0;  ///< scatter of the true temperature about the run sheet's
  double resolution = 0.0;      ///< readings are rounded to multiples of it [unit]; 0: no rounding
  std::uint64_t seed = 1;       ///< of the random numbers
  std::uint32_t stream = 0;     ///< each instrument of an assembly needs its own random stream
};

/// @return the truth on a level table. The slope of gravity in the frame table, or otherwise that
///         of
///         the turntable's axis, is removed from all fields whose source is not on the table.
///         Unchanged if the fields do not determine the slope.
[[nodiscard]] AXISCAL_EXPORT SensorModel on_level_table(SensorModel truth);

/// @return the truth with field.in_table. If the record lacks it, for example by method magnitude,
///         it is the field of the record's site on a level table with the fence to the north.
///         Unchanged if the record has no site.
[[nodiscard]] AXISCAL_EXPORT SensorModel with_field_of_site(SensorModel truth);

/// A simulated run.
struct SimulatedRun {
  Observations observations;
  /// The mean effect of the bias's random walk on the run, m entries [unit]. A calibration cannot
  /// separate it from the bias.
  Eigen::VectorXd bias_of_run;
};

/// Observations of a known truth: v_i = b + S R_sp R_i f_table + noise.
///
/// The field in the table is the truth's `in_table` (without one, its magnitude along the normal),
/// tilted further by the slope (x, y): (0, 0, 1) becomes (x, y, sqrt(1 - x^2 - y^2)). Therefore the
/// result of a calibration can be the truth. In a sum of fields, parts with a source on the table
/// keep their direction in the frame table. One-sided axes do not respond to light from behind.
///
/// @param truth  the true instrument, field and response, for example of a calibration.
/// @param sheet  the design points in the order in which they are taken.
/// @return the readings; the same seed gives the same numbers.
/// @throws DomainError  if the noise is negative or not finite, if the slope is not below 1, or if
///                      the world has numbers for another number of axes.
/// @par Source
/// method.md, sections 2, 3 and 8.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_run(const SensorModel& truth,
                                                       const std::vector<RunSheetRow>& sheet,
                                                       const SimulationOptions& options = {});

/// simulate_run() with a given random stream for the noise. stream_of_noise() gives the same
/// numbers
/// as the overload without a stream. RandomStream::seed_several() seeds several streams faster.
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
