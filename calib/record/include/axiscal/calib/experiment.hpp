// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/face_names.hpp"
#include "axiscal/calib/process_scatter.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/field_setup.hpp"
#include "axiscal/field/table_place.hpp"
#include "axiscal/instruments/instrument.hpp"
#include "axiscal/positioner/positioner.hpp"

namespace axiscal {

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
  /// How well the reference of the readings' unit is known (a voltmeter's), relative: it scales
  /// biases and sensitivities together.
  double reference_u = 0.0;
};

/// How coefficients are fitted to readings. The defaults suit nearly all runs.
///
/// @par Example
/// @code
/// axiscal::Experiment experiment;
/// experiment.fit.method = axiscal::Method::known;
/// experiment.fit.temperature.order = 1;
/// @endcode
struct FitOptions {
  std::optional<Method> method;        ///< default: choose_method()
  std::optional<Weighting> weighting;  ///< default: `samples` if the readings state them
  bool robust = false;                 ///< bisquare weights
  TemperatureSetup temperature;
  LevelBy level_by = LevelBy::run;           ///< methods paired and joint
  DriftSetup drift = DriftSetup::automatic;  ///< methods paired, joint and known
  SeatSetup seats = SeatSetup::automatic;    ///< methods paired, joint and known
  /// The scatter of biases between blocks in earlier calibrations. With it the intervals of a run
  /// of one block include that scatter.
  std::optional<ProcessScatter> process;
  /// The ratio of the noise of the axes, m entries; empty: not known. With it mistakes show better.
  Eigen::VectorXd noise_ratio;
  bool search_for_mistakes = true;  ///< whether readings that contradict each other are looked for
  MagnitudeShape shape = MagnitudeShape::symmetric;  ///< method magnitude: shape of S
  bool squares = false;            ///< method magnitude: a squared term of each axis is fitted
  bool compare_polar_fit = false;  ///< whether the known-art form is fitted too, for comparison
};

/// What is one instrument's own where instruments of several kinds share a run.
struct SlotSetup {
  std::string slot;
  Instrument instrument;
  FieldSetup field;
};

/// All that is not a reading.
struct Experiment {
  Instrument instrument;  ///< of all slots, where `slots` states none
  FieldSetup field;
  std::vector<FieldSetup> also;  ///< second fields that it answers to, known in the table
  TablePlace table;              ///< where the table stands, how it lies, and when
  /// What the axes' main sensitivities should be [unit per field unit]; mistakes in a whole run
  /// show against it. Not stated: see expected_sensitivity().
  std::optional<double> nominal_sensitivity;
  Positioner positioner;
  std::string slot;              ///< where in an assembly the instrument sits; may be empty
  std::vector<SlotSetup> slots;  ///< instruments of several kinds in one assembly
  FaceNames face_names;          ///< words that the columns rest and fence have for faces
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();  ///< its mount
  FitOptions fit;  ///< how the coefficients are fitted
  StatedUncertainties stated;
  /// What is not fitted is taken from it: of method `bias` the sensitivity.
  std::shared_ptr<const Calibration> from;
  std::vector<int> leave_out;  ///< runs not used
};

/// What the axes' sensitivities should be: as stated; else, where readings are in a unit of the
/// field's quantity, what their unit makes of one unit of the field (for g and m/s^2 by standard
/// gravity).
///
/// @param field_unit  of the reference field.
/// @return [unit per field unit]; nothing where neither says it.
[[nodiscard]] std::optional<double> expected_sensitivity(const Experiment& experiment,
                                                         const std::string& field_unit);

/// States the field that the kind of instrument is usually calibrated in, if none is stated:
/// gravity for accelerometers and inclinometers; for magnetometers the Earth's field if its
/// magnitude, its unit or the site is stated, else a field of length 1.
void take_usual_field(Experiment& experiment);
void take_usual_field(const Instrument& instrument, const TablePlace& place, FieldSetup& field);

/// The field of an experiment before anything is measured, part by part: resolve_field() at its
/// table.
/// @param time_s   for a field that moves, where the readings tell it; else the table's date.
/// @param largest  length of the largest field that the readings bring, if they bring them.
[[nodiscard]] std::vector<FieldDescription> resolve_field(const Experiment& experiment,
                                                          std::optional<double> time_s = {},
                                                          std::optional<double> largest = {});

/// The same in one, its parts together.
[[nodiscard]] FieldDescription make_field_description(const Experiment& experiment,
                                                      std::optional<double> time_s = {},
                                                      std::optional<double> largest = {});

/// @return whether the field turns in the table while readings are taken, as the sun does, or one
///         of the user's own that says so.
[[nodiscard]] bool field_moves(const Experiment& experiment);

/// @return how it changes from one time to the other, as change_of_field().
/// @throws SetupError  also where second fields stand beside one that moves.
[[nodiscard]] Eigen::Matrix3d change_of_field(const Experiment& experiment,
                                              double from_s,
                                              double to_s);

}  // namespace axiscal
