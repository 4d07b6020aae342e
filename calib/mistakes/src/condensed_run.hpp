// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Condenses a long run: within each part of the run, the readings of each pose are replaced by
/// their mean. A search for mistakes makes hundreds of fits, and the time of each is proportional
/// to
/// the number of readings.
///
/// A mean has the summed weight of its readings, and the run number of the earliest. A movement or
/// a
/// drift remains visible. A single wrong reading among thousands is less visible, but it also
/// changes the coefficients less.
///
/// @param most  the approximate largest number of readings in the result.
/// @return nullopt if the run has more than `most` poses, or if one-sided axes see only some of
///         several lights.
[[nodiscard]] std::optional<ReadingSet> condensed(const ReadingSet& set, std::size_t most);

}  // namespace axiscal
