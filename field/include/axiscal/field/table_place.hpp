// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Site, orientation and date of the table: they turn a field of the surroundings into a vector in
/// the table.
struct AXISCAL_EXPORT TablePlace {
  std::optional<Site> site;                 ///< where local fields are computed
  bool has_longitude = true;                ///< true if the longitude of the site was stated
  std::string date;                         ///< ISO 8601 or decimal year; empty: today
  std::optional<double> fence_azimuth_rad;  ///< azimuth of the table's y, clockwise from north;
                                            ///< not stated: 0, or as the readings show it
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< known slope of the table, as Levelness
};

}  // namespace axiscal
