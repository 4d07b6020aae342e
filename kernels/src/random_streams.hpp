// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace axiscal {

inline constexpr std::size_t stream_count = 8;
inline constexpr std::uint64_t exponent_of_one = 0x3FF0000000000000ULL;
inline constexpr double quarter_turn = std::numbers::pi / 2.0;

/// The initial states of eight streams of xoshiro256++, made by splitmix64 from a seed and a
/// block's number.
class RandomStreams {
 public:
  RandomStreams(std::uint64_t seed, std::uint64_t block) {
    // The seed is mixed twice, so that neighbouring seeds and blocks give unrelated states.
    std::uint64_t x = mixed(mixed(seed) ^ (block + 0x9E3779B97F4A7C15ULL));
    for (std::size_t stream = 0; stream < stream_count; ++stream) {
      for (auto& word : words_) {
        x += 0x9E3779B97F4A7C15ULL;
        word[stream] = mixed(x);
      }
    }
  }

  /// @return word `number` (0 .. 3) of the eight states.
  [[nodiscard]] const std::uint64_t* word(std::size_t number) const {
    return words_[number].data();
  }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }

  std::array<std::array<std::uint64_t, stream_count>, 4> words_{};
};

// Coefficients of the Taylor series of sin(x) / x and cos(x) in powers of x^2. The error of the
// series is 1e-17 at x = pi / 4.
inline constexpr std::array<double, 8> sine_series = {
    1.0,          -1.0 / 6,          1.0 / 120,          -1.0 / 5040,
    1.0 / 362880, -1.0 / 39916800.0, 1.0 / 6227020800.0, -1.0 / 1307674368000.0};
inline constexpr std::array<double, 9> cosine_series = {1.0,
                                                        -1.0 / 2,
                                                        1.0 / 24,
                                                        -1.0 / 720,
                                                        1.0 / 40320,
                                                        -1.0 / 3628800.0,
                                                        1.0 / 479001600.0,
                                                        -1.0 / 87178291200.0,
                                                        1.0 / 20922789888000.0};

// Coefficients of the series of 2 atanh(s) / s in powers of s^2. The error is 1e-14 at the largest
// |s|, 0.172.
inline constexpr std::array<double, 9> log_series = {2.0,      2.0 / 3,  2.0 / 5,  2.0 / 7, 2.0 / 9,
                                                     2.0 / 11, 2.0 / 13, 2.0 / 15, 2.0 / 17};
inline constexpr double root_half = 0.5 * std::numbers::sqrt2;

}  // namespace axiscal
