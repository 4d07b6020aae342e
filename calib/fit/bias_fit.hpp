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
/// The sensitivity is copied from the record experiment.from. Without a record, the nominal
/// sensitivity is used: the value that the units imply, or 1 if they imply none. A note states the
/// nominal value.
///
/// If the pose or the field of every reading is known, and the sensitivity follows from the record
/// or from the units, the response to the field is subtracted. Otherwise the response to gravity or
/// to the geomagnetic field is unknown. The bias at the reference temperature is then copied from
/// experiment.from; without a record it includes this response. The biases of a gyroscope include
/// the response to the Earth's rotation.
///
/// @param calibration  the record; its instrument and field must be set. It receives coefficients,
///                     statistics, residuals and notes.
/// @throws RefusedError, RankDeficientError  if the temperatures do not determine the polynomial.
void fit_bias(const Experiment& experiment,
              const Observations& observations,
              const ReadingSource& source,
              Calibration& calibration);

}  // namespace axiscal
