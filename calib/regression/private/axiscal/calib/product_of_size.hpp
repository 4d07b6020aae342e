// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace axiscal {

/// The product of matrices of at most so many rows and columns: written out where these are few,
/// in blocks where they may be any number.
/// @tparam Most  Eigen::Dynamic for any number.
template <int Most, typename Left, typename Right>
[[nodiscard]] auto product_of_size(const Left& left, const Right& right) {
  if constexpr (Most == Eigen::Dynamic) {
    return left * right;
  } else {
    return left.lazyProduct(right);
  }
}

/// The product of matrices of any size where one side of it is mostly short, as the columns of an
/// axis are: written out there, as blocks would have to be packed first.
template <typename Left, typename Right>
[[nodiscard]] Eigen::MatrixXd thin_product(const Left& left, const Right& right) {
  constexpr Eigen::Index few = 8;
  if (left.cols() <= few || left.rows() * right.cols() <= few * few) {
    return left.lazyProduct(right);
  }
  return left * right;
}

}  // namespace axiscal
