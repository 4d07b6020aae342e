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
  /// `to_sphere * (v - centre)` maps a reading v to the unit sphere. Before the first fit, `centre`
  /// is the midpoint of the readings' range in each axis, and `to_sphere` divides by half the
  /// largest of these ranges.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d to_sphere = Eigen::Matrix3d::Identity();
  bool is_fitted = false;
  /// True: each reading is a mean of samples at rest, and undo drops the last reading.
  bool takes_rests = false;
  /// Fraction of the sphere of directions that is within 30 degrees of a reading's direction.
  double coverage = 0.0;
  double largest_gap_rad = 0.0;
  Eigen::Vector3d gap = Eigen::Vector3d::UnitZ();  ///< direction to measure next, in sensor frame
  std::optional<double> fit_error;                 ///< relative rms error of the magnitude
  /// Expanded uncertainty (95 %) of the direction of a calibrated reading [deg], for the worst
  /// direction. It contains only the uncertainty of the coefficients. nullopt before the first fit.
  std::optional<double> u_deg;
  double wanted_deg = 0.0;
  bool is_enough = false;
  std::vector<std::pair<std::string, std::string>> numbers;  ///< label ("Hard iron [uT]") and value
};

}  // namespace axiscal
