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

/// The progress of a calibration in the hand: the sphere so far.
struct FreeView {
  std::vector<Eigen::Vector3d> points;            ///< readings kept, in the order taken [unit]
  std::size_t dropped = 0;                        ///< how often points were dropped again
  Eigen::Vector3d now = Eigen::Vector3d::Zero();  ///< current reading [unit]
  /// Maps a reading v to the sphere of radius 1: to_sphere (v - centre). Before the fit it uses the
  /// middle and the half span of the readings.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d to_sphere = Eigen::Matrix3d::Identity();
  bool is_fitted = false;
  bool takes_rests = false;  ///< readings are rests, the last of which can be undone
  double coverage = 0.0;     ///< share of the sphere within 30 degrees of a reading
  double largest_gap_rad = 0.0;
  Eigen::Vector3d gap = Eigen::Vector3d::UnitZ();  ///< direction, frame sensor, that is asked for
  std::optional<double> fit_error;                 ///< rms of |f| - F, relative to F
  /// Expanded uncertainty (95 %) of the worst direction by the coefficients alone [deg].
  std::optional<double> u_deg;
  double wanted_deg = 0.0;
  bool is_enough = false;
  std::vector<std::pair<std::string, std::string>> numbers;  ///< "Hard iron [uT]" and the like
};

}  // namespace axiscal
