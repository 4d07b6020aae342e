// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace axiscal {

/// Computes sliding variances of several columns. The result for each window of consecutive samples
/// is the sum of the squared variances of the columns. This sum is small at rest and large in
/// motion (Tedaldi et al. 2014).
///
/// The windows are computed in blocks of 8160. Within a block, running sums of x and x^2 are
/// updated from window to window; x is the difference of a sample from a reference value. The sums
/// are computed anew for each block, so that rounding errors do not accumulate.
///
/// @param columns  columns of n finite samples each.
/// @param window   number of samples in a window, 2 .. n.
/// @param joined   receives n - window + 1 results [unit^4]. Entry i is for the samples i .. i +
///                 window - 1. The denominator of the variances is window - 1.
void joined_sliding_variance(std::span<const std::span<const double>> columns,
                             std::size_t window,
                             std::span<double> joined);

/// Plain version, which computes each window separately, as a reference for tests.
void joined_sliding_variance_plain(std::span<const std::span<const double>> columns,
                                   std::size_t window,
                                   std::span<double> joined);

}  // namespace axiscal
