// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// The change of the bias during a run: a free change from block to block, and a drift (method.md,
/// section 4). These columns belong to the run, not to the instrument. With them, the bias
/// coefficient is the mean bias of the blocks, in the middle of the run.
struct RunEffects {
  Eigen::MatrixXd columns;         ///< n x e: those of the blocks, then the drift's
  std::vector<std::string> names;  ///< e
  std::vector<int> blocks;         ///< numbers of the B blocks; empty where readings tell none
  Eigen::MatrixXd
      shift_of_block;      ///< B x e: the values of the columns in each block, except for a drift
  bool has_drift = false;  ///< true if the last column is the drift, 1 over the run
  Eigen::Index small_block_columns =
      0;  ///< for blocks of a few readings, after the columns of the others

  /// @return whether blocks have columns; else their shifts are means of residuals.
  [[nodiscard]] bool has_block_columns() const { return block_columns() > 0; }

  /// @return B - 1, less 1 where a drift over three blocks or more takes up a trend of theirs.
  [[nodiscard]] double degrees_of_freedom_of_blocks() const {
    return has_block_columns() ? static_cast<double>(block_columns())
                               : static_cast<double>(blocks.size()) - 1.0;
  }

  [[nodiscard]] Eigen::Index block_columns() const {
    return columns.cols() - small_block_columns - (has_drift ? 1 : 0);
  }
};

/// With more blocks, a column for each block would cost more than it gains. Differences between
/// blocks then stay in the scatter of the readings, and the residuals show the shifts.
inline constexpr std::size_t most_block_columns = 40;

/// Which effects a fit has.
struct EffectSetup {
  bool blocks = false;  ///< shifts of blocks, where the readings tell them
  bool drift = false;   ///< a drift, linear in time or order
  bool operator==(const EffectSetup&) const = default;
};

/// With fewer readings, the other coefficients hide a block's bias.
inline constexpr int fewest_readings_of_block = 6;

/// @param readings  n. Blocks have columns if two or more of them have at least
///                  fewest_readings_of_block readings that every axis uses. Each smaller block in
///                  such a run has its own bias.
/// @param weights   n x m; 0 where an axis does not use a reading.
[[nodiscard]] RunEffects run_effects(const std::vector<Reading>& readings,
                                     const Eigen::MatrixXd& weights,
                                     EffectSetup setup);

/// The columns of readings that are not of the run, in the terms of those that are: its drift goes
/// on, and a block that it does not know is as the mean of those it knows.
/// @param run     the readings of the run.
/// @return as RunEffects::columns, for `others`.
[[nodiscard]] Eigen::MatrixXd effects_at(const RunEffects& effects,
                                         const std::vector<Reading>& run,
                                         const std::vector<Reading>& others);

/// When readings were taken, from -1/2 to 1/2: by their times where all have one, else by their
/// order; n.
[[nodiscard]] Eigen::VectorXd progress_of_run(const std::vector<Reading>& readings);

}  // namespace axiscal
