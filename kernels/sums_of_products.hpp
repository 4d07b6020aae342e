// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace axiscal {

/// X^T X of the columns x_1 .. x_p of X, for normal equations.
///
/// @param columns   each of n entries.
/// @param products  p x p, column by column, of which the lower triangle is what it says: by as
/// many
///                  accumulators as the machine likes, on which the last digits depend.
void sums_of_products(std::span<const double* const> columns, std::size_t n, double* products);

/// The same in plain code: the reference.
void sums_of_products_plain(std::span<const double* const> columns,
                            std::size_t n,
                            double* products);

}  // namespace axiscal
