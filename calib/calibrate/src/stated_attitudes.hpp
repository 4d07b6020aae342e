// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// @return whether the readings say how they were taken by attitudes.
[[nodiscard]] bool has_attitudes(const Observations& observations);

/// @return true if the attitudes give the field of each reading. The methods known and bias use
/// them.
///         A field of rotation also needs a site or a vector.
[[nodiscard]] bool takes_attitudes(const Experiment& experiment, const Observations& observations);

/// The readings with the fields that their attitudes make of the experiment's: a dividing head or a
/// sine plate stands on a level table, or on one whose slope is stated.
///
/// @throws RefusedError  where a field that is not vertical needs a heading that is not there.
/// @throws SetupError    where nothing says how the field lies in the table, or it moves.
[[nodiscard]] Observations with_fields_of_attitudes(const Experiment& experiment,
                                                    Observations observations);

}  // namespace axiscal
