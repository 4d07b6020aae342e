// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// Where the table stands, how it lies, and when the readings are taken: what turns a field of the
/// world into a vector in the table.
struct TablePlace {
  std::optional<Site> site;                 ///< where local fields are computed
  bool has_longitude = true;                ///< whether the site's longitude was stated
  std::string date;                         ///< ISO 8601 or decimal year; empty: today
  std::optional<double> fence_azimuth_rad;  ///< azimuth of the table's y, clockwise from north;
                                            ///< not stated: 0, or as the readings show it
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< known slope of the table, as Levelness
};

}  // namespace axiscal
