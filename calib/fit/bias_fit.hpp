// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// Fits only the biases, as polynomials in the temperature, to readings at rest in one pose (a
/// thermal sweep).
///
/// The sensitivity is taken from experiment.from. Without a record it is nominal: the value that
/// the units imply, else 1, for the component that the axis senses; a note says so. If the pose or
/// the field of every reading is known and a sensitivity is given, the response to the field is
/// subtracted. Otherwise the response to gravity or to the geomagnetic field is unknown: the bias
/// at the reference temperature is then that of experiment.from, or includes this response if there
/// is no record.
///
/// @param calibration  the record; its instrument and field must be set. It receives coefficients,
///                     statistics, residuals and notes.
/// @throws RefusedError, RankDeficientError  if the temperatures do not determine the polynomial.
void fit_bias(const Experiment& experiment,
              const Observations& observations,
              const ReadingSource& source,
              Calibration& calibration);

}  // namespace axiscal
