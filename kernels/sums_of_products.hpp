// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace axiscal {

/// Computes X^T X from the columns x_1 .. x_p of X, for normal equations.
///
/// @param columns   p columns of n entries.
/// @param products  receives p x p numbers, column by column. Only the lower triangle is valid. Its
///                  last digits depend on the instruction set.
void sums_of_products(std::span<const double* const> columns, std::size_t n, double* products);

/// Plain version of sums_of_products(), as a reference for tests.
void sums_of_products_plain(std::span<const double* const> columns,
                            std::size_t n,
                            double* products);

}  // namespace axiscal
