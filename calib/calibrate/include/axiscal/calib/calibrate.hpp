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

/// The method that suits an experiment where none is stated (formats.md, Experiment).
///
/// `known` if the readings bring their field or lack fence faces, `magnitude` if they lack labels,
/// else `joint`. `paired`, the method of the patent, must be stated: its averages of 12 readings
/// leave 2 degrees of freedom for an axis, `joint` 7.3 with the same estimates.
[[nodiscard]] AXISCAL_EXPORT Method choose_method(const Experiment& experiment,
                                                  const Observations& observations);

/// Calibrates an instrument: from readings to bias and sensitivity with their uncertainty.
///
/// The response is v = b + S f + e, f_i = R_sp R_i f_table(i). `paired` regresses the averages of
/// opposite positions and puts the measured tilt back in; `joint` fits all readings with the
/// direction of the field in the table as two more unknowns; `known` takes the field as given. All
/// are one linear regression core (LeastSquaresDesign).
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
/// @return coefficients, statistics, levelness, residuals and warnings; status "refused" where the
///         direction of the field remains too uncertain for the coefficients to mean anything.
/// @throws SetupError          if the experiment lacks what it needs.
/// @throws RankDeficientError  if the design does not determine a coefficient; the message names
///         the coefficient and the readings to add.
/// @throws RefusedError        if the readings are too few, or do not suit the method.
/// @par Source
/// method.md, sections 2 to 5; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT Calibration calibrate(const Experiment& experiment,
                                                   const Observations& observations);

/// As above, for arrays: reading i was taken at points[i], and row i of `response` holds its
/// values.
///
/// @code
/// std::vector<axiscal::DesignPoint> points;
/// for (const axiscal::DesignEntry& entry : axiscal::standard_design(12)) {
///   points.push_back(entry.point);
/// }
/// const axiscal::Calibration calibration = axiscal::calibrate(experiment, points, response);
/// @endcode
///
/// @param response  n x m.
/// @throws DomainError  if there are not as many points as rows; else as above.
[[nodiscard]] AXISCAL_EXPORT Calibration
calibrate(const Experiment& experiment,
          std::span<const DesignPoint> points,
          const Eigen::Ref<const Eigen::MatrixXd>& response);

/// As above. If readings contradict each other, it applies the likeliest explanation and calibrates
/// again: it corrects a label, a value or a level, or leaves the reading out. It does so up to
/// three times. Findings::corrections and notes describe the changes.
[[nodiscard]] AXISCAL_EXPORT Calibration calibrate_with_suggestions(Experiment experiment,
                                                                    Observations observations);

/// A run of one instrument in one field, with all else as it usually is.
///
/// @code
/// const axiscal::Run run = axiscal::read_run("run.csv");
/// const axiscal::Calibration cal =
///     axiscal::calibrate(run, axiscal::accelerometer("V"), axiscal::gravity());
/// @endcode
///
/// @param instrument  where its axes are x, y, z, those of the run count.
/// @param force       `yes` returns a refused calibration too, to be looked at.
/// @throws RefusedError  if the readings contradict each other so much that the calibration is
///                       refused; the message names the readings.
/// @throws SetupError    for a run of several instruments; else as calibrate().
[[nodiscard]] AXISCAL_EXPORT Calibration calibrate(const Run& run,
                                                   Instrument instrument,
                                                   FieldSetup field,
                                                   Force force = Force::no);

}  // namespace axiscal
