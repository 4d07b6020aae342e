// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// @return true if a reading states its attitude.
[[nodiscard]] bool has_attitudes(const Observations& observations);

/// @return true if the stated attitudes are converted to fields. This needs method known, faces
///         or bias. For method bias in a field of rotation, it also needs a site or a stated
///         vector.
[[nodiscard]] bool takes_attitudes(const Experiment& experiment, const Observations& observations);

/// Computes the field of each reading from its stated attitude. The dividing head or sine plate
/// stands on a level table, or on a table with a stated slope.
///
/// @throws RefusedError  if the field is not vertical and a reading lacks a heading.
/// @throws SetupError    if the field's direction in the table is unknown or changes during the
///                       run.
[[nodiscard]] Observations with_fields_of_attitudes(const Experiment& experiment,
                                                    Observations observations);

}  // namespace axiscal
