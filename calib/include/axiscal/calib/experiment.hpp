// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// What weights readings get.
enum class Weighting {
  none,     ///< all alike
  samples,  ///< as many as samples were averaged
  sd,       ///< 1 / AXIS_sd^2
};

/// @return the weighting of that name ("samples", "sd", "none"), or nothing.
[[nodiscard]] std::optional<Weighting> parse_weighting(std::string_view name);

/// @return "none", "samples", "sd".
[[nodiscard]] std::string_view weighting_name(Weighting weighting);

/// What has one levelness of the table.
enum class LevelBy {
  run,    ///< all readings
  block,  ///< each block its own: taken on different days, or the table moved between them
};

/// @return the choice of that name ("run", "block"), or nothing.
[[nodiscard]] std::optional<LevelBy> parse_level_by(std::string_view name);

/// The reference field as an experiment states it (CONTRACT section 3).
struct FieldSetup {
  std::string kind;                         ///< "gravity" or "custom"
  std::string unit;                         ///< empty: "g" for gravity, "1" for custom
  std::optional<double> magnitude;          ///< F [unit]; default: see make_field_description()
  std::optional<Eigen::Vector3d> in_table;  ///< [unit], frame table
  std::optional<Site> site;                 ///< where gravity in m/s^2 is computed
  std::string date;                         ///< ISO 8601 or decimal year; kept in the record

  /// A field of the user's own instead of kind, unit and magnitude.
  std::shared_ptr<const ReferenceField> custom;
};

/// All that is not a reading.
struct Experiment {
  std::vector<std::string> observations;  ///< files; calibrate() does not look at them
  Instrument instrument;
  FieldSetup field;
  double fence_azimuth_rad = 0.0;  ///< azimuth of the table's y, clockwise from north
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< known slope of the table, as Levelness
  Positioner positioner;
  std::string slot;  ///< of an assembly, where the instrument sits; may be empty
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();  ///< its mount
  std::optional<Method> method;        ///< default: see choose_method()
  std::optional<Weighting> weighting;  ///< default: samples where they are known
  bool robust = false;                 ///< bisquare
  LevelBy level_by = LevelBy::run;     ///< `block`: for methods paired and joint
  std::vector<int> leave_out;          ///< runs not used
};

/// An experiment that contradicts itself or lacks what it needs: a usage error.
class SetupError : public DomainError {
 public:
  using DomainError::DomainError;
};

/// The field of an experiment, before anything is measured.
///
/// Its magnitude is the given one; else the length of in_table; else 1 in `g` or `1`; else normal
/// gravity at the site. in_table is the given one; else the field at the site by the fence's
/// azimuth and the known slope.
/// @throws SetupError  if the kind or unit is not known, or the magnitude cannot be computed.
[[nodiscard]] FieldDescription make_field_description(const Experiment& experiment);

}  // namespace axiscal
