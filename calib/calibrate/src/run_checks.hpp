// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibrate.hpp"

namespace axiscal {

/// Checks that an experiment does not contradict itself or the readings, for any method.
/// @throws SetupError, DomainError, RefusedError
void check_run(const Experiment& experiment, const Observations& observations);

/// Checks that the readings and the method allow the requested temperature terms.
/// @throws SetupError, RefusedError
void check_temperature(const Experiment& experiment,
                       const std::vector<Reading>& readings,
                       Method method);

/// Checks that the method supports the experiment and the readings.
///
/// @param used      the observations without the readings that are left out of the fit.
/// @param by_field  true if each reading has its own stated field.
/// @throws SetupError, RefusedError
void check_method(const Experiment& experiment,
                  const Observations& observations,
                  const Observations& used,
                  Method method,
                  bool by_field);

/// Checks that the unit of the readings measures the same quantity as the field. Volts are always
/// allowed.
/// @throws SetupError
void check_unit(const Instrument& instrument, const FieldDescription& field);

/// Checks that a field's stated vector and stated magnitude agree.
/// @throws SetupError

void check_known_magnitude(const FieldDescription& field);

}  // namespace axiscal
