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

/// Start values for fitting the field's direction.
struct AXISCAL_EXPORT FieldStart {
  /// True if the heading of the field in the table's frame is known. The heading is unknown if the
  /// field's direction at the site is known but the fence's azimuth is not.
  bool has_heading = true;
  /// A vector in the table's frame, of any length, that selects the sign of the fitted field f. The
  /// readings do not determine this sign: a field -f with the sensitivities -S fits them as well as
  /// f with S. The fit uses the sign for which f and this vector have a positive scalar product. If
  /// this vector is zero, the expected sign of S decides.
  Eigen::Vector3d sign_by = Eigen::Vector3d::Zero();
  /// Unit vectors towards the lamps, frame table; empty if no lamps are stated. An axis that is
  /// sensitive on one side responds to the sum of the lamps only if all lamps are on that side.
  std::vector<Eigen::Vector3d> lamps;
};

/// A reference field, or one part of a sum, in the table's frame. An experiment contains the field
/// that the user stated; a record contains the field that was fitted.
struct AXISCAL_EXPORT FieldDescription {
  /// "gravity", "geomagnetic", ..., or a user's own kind; the kinds of a sum are joined by "+".
  std::string kind;
  /// The name by which readings state the level of this part; may be empty.
  std::string name;
  std::string unit = "1";                   ///< unit of magnitude and in_table
  double magnitude = 1.0;                   ///< magnitude of the field at level 1 [unit]
  double magnitude_u = 0.0;                 ///< standard uncertainty of `magnitude`; 0: not stated
  std::string model;                        ///< model's name, e.g. "wgs84"; empty without a model
  std::optional<double> local_gravity;      ///< value of 1 g [m/s^2], for a field in g
  double local_gravity_u = 0.0;             ///< standard uncertainty [m/s^2] of `local_gravity`
  std::optional<Eigen::Vector3d> in_table;  ///< given or fitted vector at level 1 [unit]
  std::optional<Eigen::Matrix3d> in_table_covariance;  ///< covariance of in_table [unit^2]
  double in_table_degrees_of_freedom = 0.0;            ///< degrees of freedom of the covariance
  std::optional<Site> site;                            ///< site for which the field was computed
  std::string date;                                    ///< date as stated; empty if not stated
  std::vector<FieldDescription> parts;                 ///< parts of a sum; otherwise empty

  bool set_by_level = true;  ///< true for an induced field: a reading's level multiplies it
  /// True if this part is the rotation of a turntable. While the table turns (its level is not 0),
  /// only the components of the other parts along the axis of rotation are added.
  bool turning = false;
  bool free_length = false;  ///< true if the magnitude is unknown and is fitted
  FieldStart start;          ///< start values for fitting the direction

  /// @return the field at a level [unit], frame table: `level` times in_table. For a sum, the level
  ///         applies to the induced parts.
  [[nodiscard]] Eigen::Vector3d at_level(double level) const;

  /// @return the parts of a sum; for a single field, a list of this field only.
  [[nodiscard]] std::vector<FieldDescription> as_parts() const;

  /// @return the name by which readings state its level: `name`, or `kind` if `name` is empty.
  [[nodiscard]] const std::string& level_name() const { return name.empty() ? kind : name; }
};

/// @return the sum of the parts, in the unit of the first part. A single part is returned as it is.
[[nodiscard]] AXISCAL_EXPORT FieldDescription sum_of(std::vector<FieldDescription> parts);

}  // namespace axiscal
