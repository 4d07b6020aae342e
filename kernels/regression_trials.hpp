// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "axiscal/kernels/repeated_fit.hpp"

namespace axiscal {

/// A linear regression `y = X b + e` that is simulated and fitted again and again; n readings, p
/// parameters, m responses fitted alike.
struct RegressionTrials {
  RepeatedDesign at;                      ///< X and its pseudo-inverse
  std::size_t responses = 0;              ///< m
  std::vector<double> unscaled_variance;  ///< diagonal of (X^T X)^-1, p
  std::vector<double> truth;              ///< b, m x p: row k of response k
  std::vector<double> noise_sd;           ///< one for each response, m
  double coverage_factor = 0.0;           ///< t: an interval is estimate +- t * standard error
};

/// Sums over trials, of one parameter of one response.
struct RegressionTrialSums {
  double error = 0.0;  ///< estimate less truth
  double error_squared = 0.0;
  double u_squared = 0.0;  ///< squared standard errors that the fits state
  double covered = 0.0;    ///< number of intervals that contain the truth
};

/// Number of trials in a block. Each block has one seed.
inline constexpr std::size_t regression_trials_block = 4096;

/// Runs one block of trials: adds normal noise to the readings X b, fits each response, and
/// estimates the scatter from the residuals.
///
/// Block b of a seed is always the same trials: eight streams of xoshiro256++, seeded from (seed,
/// b), each of which makes every eighth trial, so that neither threads nor the width of the
/// machine's vectors change them. Normals by Box and Muller.
///
/// @param count  how many of the block's trials to do, at most regression_trials_block.
/// @return m x p sums, parameter j of response k at k p + j.
/// @par Source
/// D. Blackman, S. Vigna, "Scrambled linear pseudorandom number generators", ACM Trans. Math.
/// Softw. 47 (2021); G. E. P. Box, M. E. Muller, Ann. Math. Statist. 29 (1958).
[[nodiscard]] std::vector<RegressionTrialSums> run_regression_trials(const RegressionTrials& trials,
                                                                     std::uint64_t seed,
                                                                     std::uint64_t block,
                                                                     std::size_t count);

/// The same in plain code, one trial after the other: the reference.
[[nodiscard]] std::vector<RegressionTrialSums> run_regression_trials_plain(
    const RegressionTrials& trials, std::uint64_t seed, std::uint64_t block, std::size_t count);

/// Normal numbers as the trials use them: number i of stream s at 8 i + s.
/// @param values  filled; their number must be a multiple of 16.
void fill_normals(std::uint64_t seed, std::uint64_t block, std::span<double> values);

/// The same in plain code: the reference.
void fill_normals_plain(std::uint64_t seed, std::uint64_t block, std::span<double> values);

}  // namespace axiscal
