// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// @return true if at least one reading states its attitude.
[[nodiscard]] bool has_attitudes(const Observations& observations);

/// @return true if the stated attitudes can be converted to fields. This needs the method `known`,
///         `faces` or `bias`. If the method is `bias` and the field is an angular rate, a site or
///         the field's vector must also be stated.
[[nodiscard]] bool takes_attitudes(const Experiment& experiment, const Observations& observations);

/// Computes the field of each reading from its stated attitude. The device that sets the attitudes,
/// for example a dividing head, is assumed to stand on a level table or on one with a stated slope.
///
/// @throws RefusedError  if the field is not vertical and a reading lacks a heading.
/// @throws SetupError    if the field's direction in the table is unknown or changes during the
///                       run.
[[nodiscard]] Observations with_fields_of_attitudes(const Experiment& experiment,
                                                    Observations observations);

}  // namespace axiscal
