// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/calibrate.hpp"

namespace axiscal {

/// Refuses an experiment that contradicts itself or its readings, whatever the method.
/// @throws SetupError, DomainError, RefusedError
void check_run(const Experiment& experiment, const Observations& observations);

/// Refuses temperature terms that the readings or the method cannot have.
/// @throws SetupError, RefusedError
void check_temperature(const Experiment& experiment,
                       const std::vector<Reading>& readings,
                       Method method);

/// Refuses what a method cannot do.
///
/// @param used      the readings that are not left out.
/// @param by_field  whether the readings bring their fields.
/// @throws SetupError, RefusedError
void check_method(const Experiment& experiment,
                  const Observations& observations,
                  const Observations& used,
                  Method method,
                  bool by_field);

/// Refuses readings in a unit of another quantity than the field's; volts may be of any.
/// @throws SetupError
void check_unit(const Instrument& instrument, const FieldDescription& field);

/// Refuses a field that is stated with two lengths.
/// @throws SetupError

void check_known_magnitude(const FieldDescription& field);

}  // namespace axiscal
