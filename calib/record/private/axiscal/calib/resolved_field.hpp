// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// A part of the field with all that can be known of it before anything is measured.
struct ResolvedPart {
  FieldPartDescription part;  // in_table counts where has_value
  std::string unit;
  std::string model;
  bool has_value = false;   // whether its direction is known, at least roughly
  bool has_heading = true;  // false: from the site, but the fence's azimuth is not stated
  std::optional<double> local_gravity;  // what 1 g is, for a part in g [m/s^2]
  double local_gravity_u = 0.0;         // its standard uncertainty [m/s^2]
  std::vector<Eigen::Vector3d> lamps;   // directions to each of several lamps, frame table
  Eigen::Vector3d sign_by = Eigen::Vector3d::Zero();  // as FieldStart
};

/// The field of an experiment, part by part, in the unit of the first.
///
/// @param time_s  for a field that moves, where the readings tell it; else the experiment's date.
/// @throws SetupError  if kind or unit are not known, or a magnitude cannot be computed.
[[nodiscard]] std::vector<ResolvedPart> resolve_field(const Experiment& experiment,
                                                      std::optional<double> time_s = {});

/// One part, e.g. a second field.
[[nodiscard]] ResolvedPart resolve_part(const Experiment& experiment,
                                        const FieldPart& part,
                                        std::optional<double> time_s = {});

/// What the parts make together.
[[nodiscard]] FieldDescription describe_field(const Experiment& experiment,
                                              const std::vector<ResolvedPart>& parts);

}  // namespace axiscal
