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
  double noise_sd = 0.0;      ///< each reading's [unit of the readings]
  Eigen::VectorXd noise_sds;  ///< one for each axis, in place of noise_sd; may be empty
  World world;                ///< other errors of the readings
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< the table is tilted further by this
  double fence_azimuth_rad = 0.0;  ///< the fence's; the truth's field is that of one to the north
  Positioner positioner;           ///< the cube
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();
  double temperature_sd = 0.0;  ///< scatter of the true temperature about the sheet's
  double resolution = 0.0;      ///< readings are rounded to multiples of it [unit]; 0: not
  std::uint64_t seed = 1;       ///< the noise's
  std::uint32_t stream =
      0;  ///< which part of the seed's numbers: each instrument of an assembly has its own
};

/// @return the truth with its table level: the slope that gravity has in its table, or else the
///         axis of its turntable, is taken out of all fields that are not made on the table. As
///         given where its fields do not tell the slope.
[[nodiscard]] AXISCAL_EXPORT SensorModel on_level_table(SensorModel truth);

/// @return the truth with its field in the table. A record that does not say how the field lay
///         there, as by method magnitude, gets that of its site on a level table with the fence to
///         the north; without a site it stays as it is.
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
/// tilted further by the slope (x, y): level becomes (x, y, sqrt(1 - x^2 - y^2)). So what comes out
/// of a calibration can go in here. Of a sum of fields those that are made on the table stay in it;
/// one-sided axes read nothing from behind.
///
/// @param truth  a calibration; its instrument, field and response count.
/// @param sheet  the design points in the order in which they are taken.
/// @return the readings; the same seed gives the same numbers.
/// @throws DomainError  if the noise is negative or not finite, the slope is not below 1, or the
///                      world has numbers for another count of axes.
/// @par Source
/// method.md, sections 2, 3 and 8.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_run(const SensorModel& truth,
                                                       const std::vector<RunSheetRow>& sheet,
                                                       const SimulationOptions& options = {});

/// As above, with the noise's stream stream_of_noise() for the same numbers. A caller that draws
/// from several streams seeds them together.
[[nodiscard]] AXISCAL_EXPORT SimulatedRun simulate_run(const SensorModel& truth,
                                                       const std::vector<RunSheetRow>& sheet,
                                                       const SimulationOptions& options,
                                                       RandomStream& random);
[[nodiscard]] AXISCAL_EXPORT RandomStream stream_of_noise(const SimulationOptions& options);

/// The observations of such a run alone.
[[nodiscard]] AXISCAL_EXPORT Observations simulate(const SensorModel& truth,
                                                   const std::vector<RunSheetRow>& sheet,
                                                   const SimulationOptions& options = {});

}  // namespace axiscal
