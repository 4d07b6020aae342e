// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/body.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibrate_run.hpp"
#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/calibration_fit.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/certificate_details.hpp"
#include "axiscal/calib/characterize.hpp"
#include "axiscal/calib/choices.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/confirmation.hpp"
#include "axiscal/calib/correction.hpp"
#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/drift_check.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/face_names.hpp"
#include "axiscal/calib/fit_statistics.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/history.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/labelled_check.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/levelness.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/lit_response.hpp"
#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/calib/note_code.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/polar_fit.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/recording.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/calib/repeated_design.hpp"
#include "axiscal/calib/robust.hpp"
#include "axiscal/calib/run.hpp"
#include "axiscal/calib/run_columns.hpp"
#include "axiscal/calib/sensor_model.hpp"
#include "axiscal/calib/sensor_temperature.hpp"
#include "axiscal/calib/settings.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/calib/study.hpp"
#include "axiscal/calib/summary.hpp"
#include "axiscal/calib/temperature.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/calib/turns.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/calib/uncertainty_budget.hpp"
#include "axiscal/calib/verdict.hpp"
#include "axiscal/calib/warning_code.hpp"
#include "axiscal/calib/world.hpp"
#include "axiscal/field/table_field.hpp"

/// @file
/// Estimates bias and sensitivity with their uncertainty from readings. Converts later readings to
/// fields and angles.
///
/// calibrate() takes an Experiment (instrument, field, cube, method) and readings, and returns a
/// Calibration: the sensor (SensorModel), the fit (CalibrationFit), the findings (Findings) and the
/// origin (Provenance). Reducer turns later readings into field and angles, check_drift() compares
/// a new calibration with an old one, characterize() measures a cube, forecast() and run_study()
/// predict the uncertainty before the experiment. docs/method.md describes the mathematics.
///
/// @code
/// axiscal::SensorModel truth;  // an instrument whose readings are simulated
/// truth.instrument = {.kind = "accelerometer", .unit = "V"};
/// truth.response = {Eigen::Vector3d(0.1, -0.2, 0.3), 2.5 * Eigen::Matrix3d::Identity()};
/// const std::vector<axiscal::RunSheetRow> sheet =
///     axiscal::make_run_sheet(axiscal::standard_design(12), 1, 1);
/// const axiscal::Observations readings = axiscal::simulate(truth, sheet, {.noise_sd = 1e-3});
///
/// axiscal::Experiment experiment;
/// experiment.instrument = truth.instrument;
/// experiment.field = axiscal::GravityField();
/// const axiscal::Calibration calibration = axiscal::calibrate(experiment, readings);
/// const axiscal::Reducer reduce(calibration);
/// const double volts[] = {0.1 + 2.5 * 0.342, -0.2, 0.3 + 2.5 * 0.940};
/// std::printf("pitch %.1f degrees, by %s\n", reduce(volts)["pitch_deg"],
///             std::string(axiscal::method_name(calibration.fit.method)).c_str());
/// @endcode
///
/// Traps:
/// - Check `status` before you use coefficients: a refused calibration also contains coefficients.
/// - Method `paired` leaves two degrees of freedom for 12 readings. Student's t is then 4.3, so the
///   intervals are wide.
/// - Standard errors in FitStatistics include only the scatter of the readings.
///   CalibrationFit::uncertainty also includes the stated uncertainties of the cube and of g.
/// - Readings are in the instrument's unit. A Reducer returns fields in the record's field unit.
