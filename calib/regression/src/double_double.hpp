// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace axiscal {

/// A sum with about 32 digits, stored as the unevaluated sum of two doubles.
///
/// @par Source
/// T. J. Dekker, "A floating-point technique for extending the available precision", Numerische
/// Mathematik 18 (1971) 224-242; D. E. Knuth's two-sum.
class DoubleDouble {
 public:
  explicit DoubleDouble(double value) : high_(value) {}

  void add(double value) {
    const double sum = high_ + value;
    const double back = sum - high_;
    low_ += (high_ - (sum - back)) + (value - back);
    high_ = sum;
    renormalize();
  }

  void add_product(double a, double b) {
    const double product = a * b;
    const double error = std::fma(a, b, -product);
    add(product);
    low_ += error;
    renormalize();
  }

  [[nodiscard]] double value() const { return high_; }  ///< the nearest double
  [[nodiscard]] double low() const { return low_; }  ///< the rounding error of the nearest double

 private:
  void renormalize() {
    const double sum = high_ + low_;
    low_ -= sum - high_;
    high_ = sum;
  }

  double high_;
  double low_ = 0.0;
};

}  // namespace axiscal
