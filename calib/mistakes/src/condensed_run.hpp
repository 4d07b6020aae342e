// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// A long run as means of readings that were taken in one pose, one part of the run after the
/// other. A search for mistakes costs hundreds of fits, each in proportion to the readings.
///
/// A mean has the weight of its readings, and the run number of the earliest. A movement or a drift
/// shows as before; a single wrong reading among thousands shows less, and does less.
///
/// @param most  readings of the result, about.
/// @return none if the poses alone are more.
[[nodiscard]] std::optional<ReadingSet> condensed(const ReadingSet& set, std::size_t most);

}  // namespace axiscal
