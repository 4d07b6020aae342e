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
#include "axiscal/core/export.hpp"
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

/// Standard uncertainties of inputs whose errors do not show in the readings' scatter; 0 means an
/// exact input. The uncertainties of the field's magnitude, of face normals and of mounts are
/// stated with these.
struct StatedUncertainties {
  double resolution = 0.0;  ///< smallest step of a reading [unit of the readings]; rectangular
  double slope_u = 0.0;  ///< standard uncertainty of the known slope, x and y [rad]; method known
  double direction_u_rad =
      0.0;  ///< standard uncertainty of the known field's direction, about any axis; method known
  double temperature_u = 0.0;  ///< standard uncertainty of the temperature output [its unit]
  /// Relative standard uncertainty of the reference of the readings' unit (for example a
  /// voltmeter): it scales biases and sensitivities together.
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
  bool compare_polar_fit = false;  ///< true fits the known-art form too, for comparison
};

/// The settings of one instrument if instruments of several kinds share a run.
struct SlotSetup {
  std::string slot;
  Instrument instrument;
  FieldSetup field;
};

/// All that is not a reading.
struct AXISCAL_EXPORT Experiment {
  Instrument instrument;  ///< of all slots, where `slots` states none
  FieldSetup field;
  std::vector<FieldSetup> also;  ///< second fields that it answers to, known in the table
  TablePlace table;              ///< the place of the table, its slope, and the date
  /// The expected main sensitivities of the axes [unit per field unit]. They reveal mistakes that
  /// affect a whole run. If not stated: see expected_sensitivity().
  std::optional<double> nominal_sensitivity;
  Positioner positioner;
  std::string slot;              ///< where in an assembly the instrument sits; may be empty
  std::vector<SlotSetup> slots;  ///< instruments of several kinds in one assembly
  FaceNames face_names;          ///< words that the columns rest and fence have for faces
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();  ///< its mount
  FitOptions fit;  ///< the options of the fit
  StatedUncertainties stated;
  /// Source of the coefficients that are not fitted; method `bias` takes the sensitivity from it.
  std::shared_ptr<const Calibration> from;
  std::vector<int> leave_out;  ///< runs not used
};

/// The expected sensitivities of the axes: the stated ones. Otherwise, if readings are in a unit of
/// the field's quantity, the value of one field unit in that unit (standard gravity converts
/// between g and m/s^2).
///
/// @param field_unit  of the reference field.
/// @return [unit per field unit]; nullopt if neither is available.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> expected_sensitivity(
    const Experiment& experiment, const std::string& field_unit);

/// States the field that the kind of instrument is usually calibrated in, if none is stated:
/// gravity for accelerometers and inclinometers; for magnetometers the Earth's field if its
/// magnitude, its unit or the site is stated, else a field of length 1.
AXISCAL_EXPORT void take_usual_field(Experiment& experiment);
AXISCAL_EXPORT void take_usual_field(const Instrument& instrument,
                                     const TablePlace& place,
                                     FieldSetup& field);

/// The field of an experiment before anything is measured, part by part: resolve_field() at its
/// table.
/// @param time_s   for a field that moves, if the readings give it; otherwise the table's date.
/// @param largest  length of the largest field that the readings bring, if they bring them.
[[nodiscard]] std::vector<FieldDescription> resolve_field(const Experiment& experiment,
                                                          std::optional<double> time_s = {},
                                                          std::optional<double> largest = {});

/// The same in one, its parts together.
[[nodiscard]] FieldDescription make_field_description(const Experiment& experiment,
                                                      std::optional<double> time_s = {},
                                                      std::optional<double> largest = {});

/// @return true if the field turns in the table during the readings, like the sun, or like a user's
///         field that says so.
[[nodiscard]] AXISCAL_EXPORT bool field_moves(const Experiment& experiment);

/// @return the change of the field from one time to the other, as change_of_field().
/// @throws SetupError  also if second fields are combined with one that moves.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d change_of_field(const Experiment& experiment,
                                                             double from_s,
                                                             double to_s);

}  // namespace axiscal
