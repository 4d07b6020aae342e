// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// Random numbers that are identical with every compiler if the seed is the same.
///
/// The engine is std::mt19937_64, whose output the standard defines. The standard does not define
/// the output of its distributions, so this class does not use them. It draws normal numbers by the
/// Box-Muller method, which is as exact as log, sin and cos. It draws integers by rejection.
class AXISCAL_EXPORT RandomStream {
 public:
  /// @param seed    any number; the same seed gives the same stream.
  /// @param stream  the stream's number. Streams with the same seed and different numbers are
  ///                independent.
  explicit RandomStream(std::uint64_t seed, std::uint32_t stream = 0)
      : seed_(seed), stream_(stream) {}

  /// Seeds three streams in half of the time that seeding them separately takes. Call this function
  /// before the first number is drawn.
  static void seed_several(const std::array<RandomStream*, 3>& streams);

  /// @return a uniformly distributed number in (0, 1), never 0 or 1.
  double uniform();

  /// @return a normally distributed number with mean 0 and standard deviation 1.
  double normal();

  /// @return N normal numbers; the last entry is drawn first. Use it for the components of a vector
  ///         instead of drawing them as arguments of a function, because the order of evaluation of
  ///         arguments depends on the compiler.
  template <int N>
  Eigen::Matrix<double, N, 1> normals() {
    Eigen::Matrix<double, N, 1> values;
    for (int i = N - 1; i >= 0; --i) {
      values(i) = normal();
    }
    return values;
  }

  /// @return a uniformly distributed integer in 0 .. count - 1; `count` must not be 0.
  std::size_t index(std::size_t count);

  /// Puts the items into random order (Fisher and Yates).
  template <typename Item>
  void shuffle(std::span<Item> items) {
    for (std::size_t left = items.size(); left > 1; --left) {
      std::swap(items[left - 1], items[index(left)]);
    }
  }

 private:
  // The engine's next number.
  std::uint64_t next();

  template <std::size_t count>
  static void seed_engines(const std::array<RandomStream*, count>& streams);

  std::uint64_t seed_;
  std::uint32_t stream_;
  // Seeded when the first number is drawn, because seeding is slow.
  std::optional<std::mt19937_64> engine_;
  std::optional<double> spare_normal_;
};

}  // namespace axiscal
