// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Site, orientation and date of the table. They are needed to compute the vector of a local field
/// in the table.
struct AXISCAL_EXPORT TablePlace {
  std::optional<Site> site;                 ///< place for which local fields are computed
  bool has_longitude = true;                ///< true if the longitude of the site was stated
  std::string date;                         ///< date, ISO 8601 or decimal year; if empty, today
  std::optional<double> fence_azimuth_rad;  ///< azimuth of the table's y axis, clockwise from
                                            ///< north; if nullopt, a fit starts from 0
  /// Known slope of the table: components of a vertical unit vector along the table's x and y axes.
  /// For small angles they are the slope in radians.
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

}  // namespace axiscal
