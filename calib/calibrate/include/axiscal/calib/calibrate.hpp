// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Returns the stated method or, if no method is stated, the method that suits the readings
/// (formats.md, Experiment).
///
/// The first suitable method of this list is chosen: `faces` if the cube lay on all six faces and
/// the faces at the fence are not stated; `known` if each reading has its own stated field;
/// `magnitude` if the readings have no design points; `known` if the faces at the fence are not
/// stated; otherwise `joint`. `paired`, the method of the patent, is used only if it is stated.
/// With 12 readings, `paired` and `joint` give the same estimates, but `paired` leaves only 2
/// degrees of freedom for each axis, and `joint` leaves 7.3.
[[nodiscard]] AXISCAL_EXPORT Method choose_method(const Experiment& experiment,
                                                  const Observations& observations);

/// Estimates bias and sensitivity of an instrument, with their uncertainty, from readings.
///
/// The response is v = b + S f + e with the bias b, the sensitivity matrix S, the field f in the
/// sensor's frame and the noise e. The field at reading i is f_i = R_sp R_i f_table(i), where R_i
/// rotates the table's frame to the positioner's and R_sp rotates the positioner's frame to the
/// sensor's. `paired` fits the averages of opposite readings (same rest face, opposite fence faces)
/// and then corrects for the measured slope of the table. `joint` fits all readings, with the
/// direction of the field in the table as two more unknowns. `known` takes the field as given. All
/// methods share the linear regression of LeastSquaresDesign.
///
/// @code
/// axiscal::Experiment experiment;
/// experiment.instrument = {.kind = "accelerometer", .unit = "V"};
/// experiment.field = axiscal::GravityField();
/// const axiscal::Calibration calibration = axiscal::calibrate(experiment, observations);
/// @endcode
///
/// @param experiment    instrument, field, table, cube and method.
/// @param observations  n readings of the instrument's m axes.
/// @return coefficients, statistics, levelness, residuals and warnings. The status is "refused" if
///         the coefficients must not be used, for example if the field's direction is too
///         uncertain.
/// @throws SetupError          if the experiment lacks a required input.
/// @throws RankDeficientError  if the design does not determine a coefficient; the message names
///         the coefficient and the readings to add.
/// @throws RefusedError        if the readings are too few, or do not suit the method.
/// @par Source
/// method.md, sections 2 to 5; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT Calibration calibrate(const Experiment& experiment,
                                                   const Observations& observations);

/// Calibrates an instrument from arrays. points[i] is the design point of reading i, and row i of
/// `response` contains the values of all axes in this reading.
///
/// @code
/// std::vector<axiscal::DesignPoint> points;
/// for (const axiscal::DesignEntry& entry : axiscal::standard_design(12)) {
///   points.push_back(entry.point);
/// }
/// const axiscal::Calibration calibration = axiscal::calibrate(experiment, points, response);
/// @endcode
///
/// @param response  n x m [unit of the instrument].
/// @throws DomainError  if the number of points differs from the number of rows. Other errors as in
///                      calibrate() for Observations.
[[nodiscard]] AXISCAL_EXPORT Calibration
calibrate(const Experiment& experiment,
          std::span<const DesignPoint> points,
          const Eigen::Ref<const Eigen::MatrixXd>& response);

/// Calibrates like calibrate() for Observations, and applies suggested corrections. If readings
/// contradict each other, it corrects the likeliest mistake and calibrates again, up to three
/// times. A correction changes a label, a value or a level, or leaves a reading out.
/// Findings::corrections and notes describe the changes.
[[nodiscard]] AXISCAL_EXPORT Calibration calibrate_with_suggestions(Experiment experiment,
                                                                    Observations observations);

/// Calibrates one instrument in one field from a run, with default options.
///
/// @code
/// const axiscal::Run run = axiscal::read_run("run.csv");
/// const axiscal::Calibration cal =
///     axiscal::calibrate(run, axiscal::accelerometer("V"), axiscal::gravity());
/// @endcode
///
/// @param instrument  the instrument. If its axes are x, y, z (the default), the axes of the run
///                    are used.
/// @param force       `yes` also returns a refused calibration.
/// @throws RefusedError  if the calibration is refused and `force` is `no`; the message contains
///                       its first warning.
/// @throws SetupError    if the run contains several instruments. Other errors as in calibrate()
///                       for Observations.
[[nodiscard]] AXISCAL_EXPORT Calibration calibrate(const Run& run,
                                                   Instrument instrument,
                                                   FieldSetup field,
                                                   Force force = Force::no);

}  // namespace axiscal
