// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace axiscal {

/// Sliding variances of several columns, joined: the sum over columns of variance^2, for each
/// window of consecutive samples. Small at rest, large in motion (Tedaldi et al. 2014).
///
/// The sums of x and x^2 about a reference value slide along the block. They are computed again
/// every 8192 samples, so that rounding errors do not add up.
///
/// @param columns  of n finite samples each.
/// @param window   samples in a window, 2 .. n.
/// @param joined   n - window + 1 results: entry i is of the samples i .. i + window - 1; variances
///                 with window - 1 in the denominator [unit^4].
void joined_sliding_variance(std::span<const std::span<const double>> columns,
                             std::size_t window,
                             std::span<double> joined);

/// The same in plain code, each window by itself: the reference.
void joined_sliding_variance_plain(std::span<const std::span<const double>> columns,
                                   std::size_t window,
                                   std::span<double> joined);

}  // namespace axiscal
