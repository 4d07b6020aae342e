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
  int order = 0;           ///< order of the polynomials of bias and scale; 0: no terms
  bool automatic = false;  ///< true: the order is chosen from the readings
  /// True: temperatures are ignored. By default (`order` 0, `automatic` and `ignored` false), the
  /// temperature terms are fitted only if the readings have enough different temperatures and the
  /// terms are highly significant.
  bool ignored = false;
  std::optional<double> reference;  ///< reference temperature; default: mean of the readings
};

/// Standard uncertainties of inputs whose errors do not increase the scatter of the readings. 0
/// means that the input is exact. The uncertainties of the field's magnitude, of face normals and
/// of mounts are members of FieldSetup and Positioner.
struct StatedUncertainties {
  double resolution = 0.0;  ///< smallest step of a reading [unit of the readings]
  /// Standard uncertainty of the stated slope, for each of x and y [rad]. Only for method
  /// `known`.
  double slope_u = 0.0;
  /// Standard uncertainty of the field's direction, about any axis. Only for method `known`.
  double direction_u_rad = 0.0;
  double temperature_u = 0.0;  ///< standard uncertainty of the temperature output [its unit]
  /// Relative standard uncertainty of the electrical reference of the readings, for example of a
  /// voltmeter. An error of the reference scales all biases and sensitivities by one factor.
  double reference_u = 0.0;
};

/// Options of the fit of coefficients to readings. The defaults suit nearly all runs.
///
/// @par Example
/// @code
/// axiscal::Experiment experiment;
/// experiment.fit.method = axiscal::Method::known;
/// experiment.fit.temperature.order = 1;
/// @endcode
struct FitOptions {
  std::optional<Method> method;  ///< default: choose_method()
  /// Default: `samples` if the readings state their numbers of samples; otherwise `none`.
  std::optional<Weighting> weighting;
  bool robust = false;  ///< true: robust regression with bisquare weights
  TemperatureSetup temperature;
  LevelBy level_by = LevelBy::run;           ///< used only by methods paired and joint
  DriftSetup drift = DriftSetup::automatic;  ///< used only by methods paired, joint, known
  SeatSetup seats = SeatSetup::automatic;    ///< used only by methods paired, joint, known
  /// The scatter of biases between blocks in earlier calibrations. If it is set, the intervals of a
  /// run with one block include this scatter.
  std::optional<ProcessScatter> process;
  /// The noise of each axis, up to a common factor, m entries; empty if unknown. The ratios of the
  /// entries make the search for mistakes more sensitive.
  Eigen::VectorXd noise_ratio;
  bool search_for_mistakes = true;  ///< true: searches for readings that contradict each other
  MagnitudeShape shape = MagnitudeShape::symmetric;  ///< used only by method magnitude
  bool squares = false;            ///< true: fits squared terms of the axes; only method magnitude
  bool compare_polar_fit = false;  ///< true: also fits the polar form, for comparison
};

/// The settings of one instrument if instruments of several kinds share a run.
struct SlotSetup {
  std::string slot;
  Instrument instrument;
  FieldSetup field;
};

/// All inputs of a calibration except the readings.
struct AXISCAL_EXPORT Experiment {
  Instrument instrument;  ///< the instrument in every slot if `slots` is empty
  FieldSetup field;
  /// Additional fields to which the instrument responds. Their vectors in the frame `table` must be
  /// known.
  std::vector<FieldSetup> also;
  TablePlace table;  ///< the place of the table, its slope, and the date
  /// The expected main sensitivity of every axis [unit per field unit]. The fit is compared with
  /// this value to find mistakes that affect the whole run. If the value is nullopt,
  /// expected_sensitivity() gives the default.
  std::optional<double> nominal_sensitivity;
  Positioner positioner;
  std::string slot;              ///< slot of the instrument in an assembly; may be empty
  std::vector<SlotSetup> slots;  ///< instruments of several kinds in one assembly
  FaceNames face_names;          ///< words for faces in the columns `rest` and `fence`
  Eigen::Matrix3d rotation_sensor_from_positioner = Eigen::Matrix3d::Identity();  ///< the mount
  FitOptions fit;  ///< the options of the fit
  StatedUncertainties stated;
  /// Record that supplies the coefficients that are not fitted. Method `bias` takes the
  /// sensitivities from it.
  std::shared_ptr<const Calibration> from;
  std::vector<int> leave_out;  ///< run numbers of the readings that are not used
};

/// Returns the expected sensitivity of every axis. It is Experiment::nominal_sensitivity if this is
/// set. Otherwise, if the unit of the readings is a unit of the field's quantity, it is the factor
/// between the two units, for example 9.80665 between g and m/s^2.
///
/// @param field_unit  the unit of the reference field.
/// @return the sensitivity [unit per field unit]; nullopt in all other cases.
[[nodiscard]] AXISCAL_EXPORT std::optional<double> expected_sensitivity(
    const Experiment& experiment, const std::string& field_unit);

/// Sets the usual field for the kind of instrument, unless a field is stated. It is gravity for
/// accelerometers and inclinometers. For magnetometers it is the Earth's field if the magnitude,
/// the unit, the vector in the table or the site is stated. Otherwise it is a field of magnitude 1.
AXISCAL_EXPORT void set_default_field(Experiment& experiment);
AXISCAL_EXPORT void set_default_field(const Instrument& instrument,
                                      const TablePlace& place,
                                      FieldSetup& field);

/// Returns the parts of an experiment's field, as they are known before the fit.
/// @param time_s   time of the readings, used if the field moves; nullopt: the table's date.
/// @param largest  largest magnitude of the fields that are stated with the readings; nullopt if no
///                 reading states its field.
[[nodiscard]] std::vector<FieldDescription> resolve_field(const Experiment& experiment,
                                                          std::optional<double> time_s = {},
                                                          std::optional<double> largest = {});

/// Returns the description of an experiment's whole field, as it is known before the fit.
[[nodiscard]] FieldDescription make_field_description(const Experiment& experiment,
                                                      std::optional<double> time_s = {},
                                                      std::optional<double> largest = {});

/// @return true if the field's direction in the frame `table` changes during the readings. This is
///         so for the sun, and for user-defined field classes that are declared as moving.
[[nodiscard]] AXISCAL_EXPORT bool field_moves(const Experiment& experiment);

/// @return the matrix that converts the field's vector at time `from_s` to its vector at time
///         `to_s`, from change_of_field() for `experiment.field`.
/// @throws SetupError  as change_of_field() for a FieldSetup, or if a moving field is combined with
///                     additional fields.
[[nodiscard]] AXISCAL_EXPORT Eigen::Matrix3d change_of_field(const Experiment& experiment,
                                                             double from_s,
                                                             double to_s);

}  // namespace axiscal
