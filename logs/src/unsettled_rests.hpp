// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/logs/segment.hpp"

namespace axiscal {

/// The starts of rests at which the readings have not settled.
struct UnsettledRests {
  /// Ranges of samples to leave out, one for each rest: the index of the first sample, and one past
  /// the index of the last. Empty if the readings have settled.
  std::vector<std::pair<std::size_t, std::size_t>> spans;
  double fraction = 0.0;  ///< the part of each rest that the spans cover
  double largest = 0.0;   ///< largest difference of the first samples from the later ones [unit]
  bool settles = true;    ///< false if the samples still change at the end of the rests
};

/// Divides each rest into eight parts and compares the means of these parts by
/// find_unsettled_start().
/// @param rests    rests of fewer than 24 samples are not compared.
/// @param columns  the columns to compare; each contains all samples of the log.
[[nodiscard]] UnsettledRests find_unsettled_rests(
    const std::vector<StaticInterval>& rests,
    const std::vector<const std::vector<double>*>& columns);

/// Finds the rests again without the samples of `unsettled`.
/// @param log      the log from its start.
/// @param options  the options with which `rests` were found.
/// @return the rests; nullopt if a rest becomes too short.
[[nodiscard]] std::optional<Segmentation> settled_rests(LogFile& log,
                                                        SegmentOptions options,
                                                        const Segmentation& rests,
                                                        const UnsettledRests& unsettled);

/// @param left_out  true if the samples were left out; false if the rests would be too short.
[[nodiscard]] std::string sentence_about(const UnsettledRests& unsettled, bool left_out);

}  // namespace axiscal
