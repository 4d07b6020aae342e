// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// @return true if the readings state their attitudes.
[[nodiscard]] bool has_attitudes(const Observations& observations);

/// @return true if the attitudes give the field of each reading. The methods known and bias use
/// them.
///         A field of rotation also needs a site or a vector.
[[nodiscard]] bool takes_attitudes(const Experiment& experiment, const Observations& observations);

/// The readings, with the experiment's field turned to their attitudes: a dividing head or a sine
/// plate stands on a level table, or on one with a stated slope.
///
/// @throws RefusedError  where a field that is not vertical needs a heading that is not there.
/// @throws SetupError    where nothing says how the field lies in the table, or it moves.
[[nodiscard]] Observations with_fields_of_attitudes(const Experiment& experiment,
                                                    Observations observations);

}  // namespace axiscal
