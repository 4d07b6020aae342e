// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/site.hpp"

namespace axiscal {

/// From where a fit of the field's direction begins.
struct AXISCAL_EXPORT FieldStart {
  bool has_heading = true;  ///< false: it follows from the site, but the fence's azimuth is open
  /// (S, f) and (-S, -f) fit alike. This vector decides between them; if it is zero, the sign that
  /// is expected of S does. Frame table, any length.
  Eigen::Vector3d sign_by = Eigen::Vector3d::Zero();
  /// Directions to each of several lamps, frame table. A one-sided axis responds to their sum only
  /// if it sees every lamp.
  std::vector<Eigen::Vector3d> lamps;
};

/// A reference field, or one part, in the table's frame: in an experiment as stated, in a record as
/// fitted.
struct AXISCAL_EXPORT FieldDescription {
  std::string kind;  ///< "gravity", "geomagnetic", ..., or a user's own; of a sum joined by "+"
  std::string name;  ///< by which readings state the level of a part; may be empty
  std::string unit = "1";                   ///< unit of magnitude and in_table
  double magnitude = 1.0;                   ///< F at level 1 [unit]
  double magnitude_u = 0.0;                 ///< its standard uncertainty [unit]; 0: not stated
  std::string model;                        ///< "wgs84", "wmm2025", ... where one was used
  std::optional<double> local_gravity;      ///< m/s^2 per g, for a field in g
  double local_gravity_u = 0.0;             ///< its standard uncertainty [m/s^2]; 0: not stated
  std::optional<Eigen::Vector3d> in_table;  ///< given or estimated, at level 1 [unit], frame table
  std::optional<Eigen::Matrix3d> in_table_covariance;  ///< `joint`: of in_table [unit^2]
  double in_table_degrees_of_freedom = 0.0;            ///< those of in_table_covariance
  std::optional<Site> site;                            ///< site for which the field was computed
  std::string date;                                    ///< as given; gravity needs none
  std::vector<FieldDescription> parts;                 ///< parts of a sum; otherwise empty

  bool set_by_level = true;  ///< true if the level of a reading multiplies it: an induced field
  bool turning = false;      ///< the table turns about this field: only the components of the
                             ///< other parts along its axis remain on average, except at level 0
  bool free_length = false;  ///< its magnitude is not known and is fitted
  FieldStart start;          ///< of a fit of its direction

  /// @return the field in the table at a level [unit]: `level` times in_table, for a sum by its
  ///         parts.
  [[nodiscard]] Eigen::Vector3d at_level(double level) const;

  /// @return the parts of a sum, else the field itself as the only one.
  [[nodiscard]] std::vector<FieldDescription> as_parts() const;

  /// @return by which name readings state its level: its name, else its kind.
  [[nodiscard]] const std::string& level_name() const { return name.empty() ? kind : name; }
};

/// @return the sum of the parts in the unit of the first part; the field itself for one part.
[[nodiscard]] AXISCAL_EXPORT FieldDescription sum_of(std::vector<FieldDescription> parts);

}  // namespace axiscal
