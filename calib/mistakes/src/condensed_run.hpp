// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Condenses a long run: within each part of the run, the readings of each pose are replaced by
/// their mean. A search for mistakes makes hundreds of fits, and the time of a fit is proportional
/// to the number of readings.
///
/// The weight of a mean is the sum of the weights of its readings. Its run number is that of the
/// earliest reading. A movement of the table or a drift can still be detected. A single wrong
/// reading among thousands is harder to detect, but it also changes the coefficients less.
///
/// @param most  the approximate largest number of readings in the result.
/// @return nullopt if the set has too many different poses (more than `most`), or if it has
///         one-sided axes whose response depends on which of several lights they face
///         (ReadingSet::visible is then not empty).
[[nodiscard]] std::optional<ReadingSet> condensed(const ReadingSet& set, std::size_t most);

}  // namespace axiscal
