// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "axiscal/kernels/repeated_fit.hpp"

namespace axiscal {

/// A linear regression `y = X b + e` that is simulated and fitted many times. It has n readings, p
/// parameters, and m responses with the same X.
struct RegressionTrials {
  RepeatedDesign at;                      ///< X and its pseudo-inverse
  std::size_t responses = 0;              ///< number m of responses
  std::vector<double> unscaled_variance;  ///< diagonal of (X^T X)^-1, p entries
  std::vector<double> truth;              ///< true b, m x p: row k is b of response k
  std::vector<double> noise_sd;           ///< standard deviations of e, one for each response
  double coverage_factor = 0.0;           ///< t in the interval estimate +- t * standard error
};

/// Sums over trials, for one parameter of one response.
struct RegressionTrialSums {
  double error = 0.0;  ///< sum of estimate minus truth
  double error_squared = 0.0;
  double u_squared = 0.0;  ///< sum of squared standard errors from the fits
  double covered = 0.0;    ///< number of intervals that contain the truth
};

/// Number of trials in a block. Each block has its own random numbers.
inline constexpr std::size_t regression_trials_block = 4096;

/// Runs one block of trials: adds normal noise to the readings X b, fits each response, and
/// estimates the scatter from the residuals.
///
/// The trials of a block depend only on `seed` and `block`. Eight streams of xoshiro256++ are
/// seeded from these two numbers, and each stream runs every eighth trial. Therefore the
/// trials do not depend on the number of threads or on the width of the machine's vectors. Normal
/// random numbers are drawn by the method of Box and Muller.
///
/// @param count  number of trials to run, at most regression_trials_block.
/// @return m x p sums; those of parameter j of response k are at the index k p + j.
/// @par Source
/// D. Blackman, S. Vigna, "Scrambled linear pseudorandom number generators", ACM Trans. Math.
/// Softw. 47 (2021); G. E. P. Box, M. E. Muller, Ann. Math. Statist. 29 (1958).
[[nodiscard]] std::vector<RegressionTrialSums> run_regression_trials(const RegressionTrials& trials,
                                                                     std::uint64_t seed,
                                                                     std::uint64_t block,
                                                                     std::size_t count);

/// Plain version of run_regression_trials(), one trial after the other, as a reference for tests.
[[nodiscard]] std::vector<RegressionTrialSums> run_regression_trials_plain(
    const RegressionTrials& trials, std::uint64_t seed, std::uint64_t block, std::size_t count);

/// Draws the normal random numbers of a block of trials. Number i of stream s is at index 8 i + s.
/// @param values  receives the numbers; its size must be a multiple of 16.
void fill_normals(std::uint64_t seed, std::uint64_t block, std::span<double> values);

/// Plain version of fill_normals(), as a reference for tests.
void fill_normals_plain(std::uint64_t seed, std::uint64_t block, std::span<double> values);

}  // namespace axiscal
