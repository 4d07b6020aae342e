// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/process_scatter.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/induced_field.hpp"
#include "axiscal/field/reference_field.hpp"
#include "axiscal/field/site.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

/// One part of the reference field, as an experiment states it (formats.md, Experiment).
struct FieldPart {
  /// "gravity", "geomagnetic", "earth_rotation", "induced_rotation", "induced_magnetic", "light" or
  /// "custom".
  std::string kind;
  std::optional<FieldRole> role;  ///< default: the kind's
  /// Empty: the first of the kind's; where no magnitude is stated, the readings' own if the kind
  /// has it.
  std::string unit;
  std::optional<double> magnitude;          ///< F [unit]; default: see make_field_description()
  double magnitude_u = 0.0;                 ///< its standard uncertainty [unit]
  std::optional<Eigen::Vector3d> in_table;  ///< [unit], frame table
  std::string model;         ///< which gravity or geomagnetic model; empty: wgs84, wmm2025
  std::optional<Coil> coil;  ///< that makes induced_magnetic
  std::vector<Lamp> lamps;   ///< that make light, all at once
  bool sun = false;          ///< light is the sun's, at the site and each reading's time
  bool refraction = false;   ///< the sun is seen as the air lifts it

  /// A field of the user's own instead of kind, role, unit and magnitude.
  std::shared_ptr<const ReferenceField> custom;
};

/// The reference field: one part, or the sum of several.
struct FieldSetup : FieldPart {
  std::vector<FieldPart> others;  ///< further parts, local and induced, that add up
  std::optional<Site> site;       ///< where local fields are computed
  bool has_longitude = true;      ///< whether the site's longitude was stated
  std::string date;               ///< ISO 8601 or decimal year; today
};

/// Temperature terms (method.md, section 6).
struct TemperatureSetup {
  int order = 0;           ///< order of the polynomials of bias and scale; 0: none
  bool automatic = false;  ///< the order that the readings ask for
  /// Temperatures are passed over. Else, with order 0, they are looked at as by `automatic` where
  /// readings at enough temperatures have them, and terms are fitted if they are clearly there.
  bool ignored = false;
  std::optional<double> reference;  ///< t0; default: mean of the readings
};

/// What is not exactly known and no scatter of readings shows: standard uncertainties, 0 for none.
/// Those of the field's magnitude, face normals and mounts are stated with these.
struct StatedUncertainties {
  double resolution = 0.0;  ///< smallest step of a reading [unit of the readings]; rectangular
  double slope_u = 0.0;     ///< how well the known slope is known, x and y [rad]; method known
  double direction_u_rad =
      0.0;  ///< how well the known field's direction is known, any way; method known
  double temperature_u = 0.0;  ///< how well the temperature output is known [its unit]
};

/// All that is not a reading.
struct Experiment {
  std::vector<std::string> observations;  ///< files; calibrate() does not look at them
  Instrument instrument;
  FieldSetup field;
  std::vector<FieldPart> also;  ///< second fields that it answers to, known in the table
  std::optional<double> fence_azimuth_rad;  ///< azimuth of the table's y, clockwise from north;
                                            ///< not stated: 0, or as the readings show it
  /// What the axes' main sensitivities should be [unit per field unit]; mistakes in a whole run
  /// show against it. Not stated: see expected_sensitivity().
  std::optional<double> nominal_sensitivity;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< known slope of the table, as Levelness
  Positioner positioner;
  std::string slot;  ///< where in an assembly the instrument sits; may be empty
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();  ///< its mount
  std::optional<Method> method;                      ///< default: see choose_method()
  std::optional<Weighting> weighting;                ///< default: samples where they are known
  MagnitudeShape shape = MagnitudeShape::symmetric;  ///< what method magnitude takes S to be
  /// How the noise of the axes compares, m entries; empty: not known. Mistakes then show better.
  Eigen::VectorXd noise_ratio;
  bool compare_polar_fit = false;   ///< whether the known-art form is fitted too, for comparison
  bool search_for_mistakes = true;  ///< whether readings that contradict each other are looked for
  bool robust = false;              ///< bisquare
  LevelBy level_by = LevelBy::run;  ///< `block`: for methods paired and joint
  DriftSetup drift = DriftSetup::automatic;  ///< methods paired, joint and known
  SeatSetup seats = SeatSetup::automatic;    ///< likewise
  /// What earlier calibrations say of how biases change between blocks; with it one block, too,
  /// knows more than what repeats within it.
  std::optional<ProcessScatter> process;
  TemperatureSetup temperature;
  StatedUncertainties stated;
  /// What is not fitted is taken from it: of method `bias` the sensitivity.
  std::shared_ptr<const Calibration> from;
  std::vector<int> leave_out;  ///< runs not used
  std::string limits;          ///< file of what a unit must meet; calibrate() does not look at it
};

/// What the axes' sensitivities should be: as stated; else, where readings are in a unit of the
/// field's quantity, what their unit makes of one unit of the field (for g and m/s^2 by standard
/// gravity).
///
/// @param field_unit  of the reference field.
/// @return [unit per field unit]; nothing where neither says it.
[[nodiscard]] std::optional<double> expected_sensitivity(const Experiment& experiment,
                                                         const std::string& field_unit);

/// States the field that the kind of instrument is usually calibrated in, where none is stated:
/// gravity for accelerometers and inclinometers.
void take_usual_field(Experiment& experiment);

/// @throws SetupError  for a kind of field that is not known; the message lists the kinds.
void check_field_kind(const std::string& kind);

/// @throws SetupError  for a unit that a kind of field is not given in.
void check_field_unit(const std::string& kind, const std::string& unit);

/// @return whether a part is made on the table: by its role, its own class, or its kind.
[[nodiscard]] bool is_made_on_table(const FieldPart& part);

/// The field of an experiment, before anything is measured.
///
/// Its magnitude is the given one; else the length of in_table; else 1 in `g` or `1`; else what a
/// model gives at the site and date, a coil's geometry, the sum of lamps. in_table is the given
/// one; else the field at the site by the fence's azimuth and the known slope; a turntable's is
/// along the table's normal. A sum is in the unit of its first part.
/// @throws SetupError  if the kind or unit is not known, or the magnitude cannot be computed.
[[nodiscard]] FieldDescription make_field_description(const Experiment& experiment);

}  // namespace axiscal
