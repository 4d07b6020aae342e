// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Lists the sources of a calibration's uncertainty: the fit, and the stated uncertainties of the
/// experiment (method.md, section 8).
///
/// @param set             the readings that were fitted; empty for method `bias`.
/// @param weighed         the contributions that the fit already includes, from
///                        weigh_shared_errors().
[[nodiscard]] UncertaintyBudget make_budget(const Experiment& experiment,
                                            const ReadingSet& set,
                                            const Calibration& calibration,
                                            const TableField& field,
                                            std::vector<UncertaintySource> weighed);

}  // namespace axiscal
