// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// The biases alone, over temperature, from readings at rest in one pose: a thermal sweep.
///
/// The sensitivity is that of experiment.from, else nominal: 1 for the component that an axis
/// senses, and said so. Where labels or fields say what the instrument met, and a sensitivity is
/// given, its part is taken out; else that of gravity or of the geomagnetic field cannot be known:
/// the bias at the reference is then that of experiment.from, if there is one, and else what was
/// read.
///
/// @param calibration  described but not fitted; coefficients, statistics, residuals and notes are
///                     put in.
/// @throws RefusedError, RankDeficientError  where the temperatures do not determine the order.
void fit_bias(const Experiment& experiment,
              const Observations& observations,
              const ReadingSource& source,
              Calibration& calibration);

}  // namespace axiscal
