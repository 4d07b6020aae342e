// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"

namespace axiscal {

/// The progress of a FreeSession.
struct FreeView {
  std::vector<Eigen::Vector3d> points;            ///< readings kept, in the order taken [unit]
  std::size_t dropped = 0;                        ///< number of readings dropped by undo
  Eigen::Vector3d now = Eigen::Vector3d::Zero();  ///< current reading [unit]
  /// The map of a reading v to the unit sphere: to_sphere (v - centre). Before the first fit,
  /// centre is the middle of the readings, and to_sphere divides by half their largest span.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d to_sphere = Eigen::Matrix3d::Identity();
  bool is_fitted = false;
  bool takes_rests = false;  ///< each reading is a rest; undo drops the last one
  double coverage = 0.0;     ///< share of the sphere within 30 degrees of a reading
  double largest_gap_rad = 0.0;
  Eigen::Vector3d gap = Eigen::Vector3d::UnitZ();  ///< direction of the next reading, frame sensor
  std::optional<double> fit_error;                 ///< rms error of the magnitude, relative to F
  /// Expanded uncertainty (95 %) of the direction of a calibrated reading [deg]: the largest over
  /// all directions, from the uncertainty of the coefficients only. nullopt without a fit.
  std::optional<double> u_deg;
  double wanted_deg = 0.0;
  bool is_enough = false;
  std::vector<std::pair<std::string, std::string>> numbers;  ///< label ("Hard iron [uT]") and value
};

}  // namespace axiscal
