// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/observations.hpp"

namespace axiscal {

/// A step of the biases within a block (method.md, section 4).
struct BiasStep {
  int after_run = 0;  ///< run number of the last reading before the step
  int block = 0;
  /// readings after the step in its block, as a fraction of all readings of the run
  double mean = 0.0;
};

/// Changes of the readings in the course of a run: a bias shift of each block, a step of the bias,
/// a drift, and a memory of the previous reading (method.md, section 4). These effects belong to
/// the run, not to the instrument. If a fit has columns for them, its bias is the mean bias of the
/// run.
struct RunEffects {
  /// n x e: the columns of the blocks, the step and the drift. The column of the memory contains
  /// zeros.
  Eigen::MatrixXd columns;
  std::vector<std::string> names;  ///< names of the e columns
  std::vector<int> blocks;         ///< identifiers of the B blocks; empty if blocks are not fitted
  /// B x e: the value of each column in each block; 0 in columns that change within a block
  Eigen::MatrixXd shift_of_block;
  bool has_drift = false;  ///< true if a column is the drift, which changes by 1 over the run
  std::optional<BiasStep> step;
  /// n x m: the memory column of each axis, which is the previous reading minus the present reading
  /// [unit]; 0 x 0 if there is no memory.
  Eigen::MatrixXd memory;
  /// Identifiers of the blocks with few readings. Each of these blocks has a column, after the
  /// columns of the other blocks.
  std::vector<int> small_blocks;

  /// @return true if the shifts of the blocks are fitted as columns; false if they are computed as
  ///         means of residuals.
  [[nodiscard]] bool has_block_columns() const { return block_columns() > 0; }

  /// @return the degrees of freedom of the shifts of the blocks: B - 2 if a drift is fitted to
  ///         three blocks or more, otherwise B - 1.
  [[nodiscard]] double degrees_of_freedom_of_blocks() const {
    return has_block_columns() ? static_cast<double>(block_columns())
                               : static_cast<double>(blocks.size()) - 1.0;
  }

  [[nodiscard]] Eigen::Index block_columns() const {
    return columns.cols() - static_cast<Eigen::Index>(small_blocks.size()) -
           columns_within_blocks();
  }

  /// @return the number of columns that change within a block; they are the last ones.
  [[nodiscard]] Eigen::Index columns_within_blocks() const {
    return (step ? 1 : 0) + (has_drift ? 1 : 0) + (memory.size() > 0 ? 1 : 0);
  }

  /// @return the index of the step's column.
  [[nodiscard]] Eigen::Index step_column() const {
    return columns.cols() - columns_within_blocks();
  }

  /// @return the index of the drift's column.
  [[nodiscard]] Eigen::Index drift_column() const {
    return columns.cols() - 1 - (memory.size() > 0 ? 1 : 0);
  }

  /// @return the row for one reading in the effect columns of an axis.
  [[nodiscard]] Eigen::RowVectorXd row(Eigen::Index reading, Eigen::Index axis) const;

  /// @return the effects for means over groups of readings: the columns and the memory are averaged
  ///         over each group.
  [[nodiscard]] RunEffects of_means(const std::vector<std::vector<Eigen::Index>>& groups) const;
};

/// The largest number of blocks that get columns. With more blocks, the columns would cost more
/// than they gain; differences between blocks then remain in the scatter of the readings, and the
/// shifts are computed from the residuals.
inline constexpr std::size_t most_block_columns = 40;

/// The effects that a fit includes.
struct EffectSetup {
  bool blocks = false;  ///< shifts of blocks, if the readings determine them
  /// a drift that is linear in time, or in the order of the readings if times are missing
  bool drift = false;
  /// a shift of each reading by a fraction of its difference from the previous reading
  bool memory = false;
  /// run number of the reading after which the biases step. The step lasts until the end of the
  /// block of this reading.
  std::optional<int> step_after_run = {};
  bool operator==(const EffectSetup&) const = default;
};

/// Blocks with fewer readings than this are small blocks (RunEffects::small_blocks), because the
/// other coefficients would absorb part of their biases.
inline constexpr int fewest_readings_of_block = 6;

/// @param readings  the n readings of the run. Blocks have columns if two or more of them have at
///                  least fewest_readings_of_block readings that every axis uses. Each smaller
///                  block in such a run has its own bias.
/// @param weights   n x m; 0 if an axis does not use a reading.
[[nodiscard]] RunEffects run_effects(const std::vector<Reading>& readings,
                                     const Eigen::MatrixXd& weights,
                                     EffectSetup setup);

/// Adds the memory column (RunEffects::memory) to the effects.
/// @param response  n x m [unit].
void add_memory(const std::vector<Reading>& readings,
                const Eigen::MatrixXd& response,
                RunEffects& effects);

/// Returns for each reading the previous response minus the response at this reading. The readings
/// are in the order of order_of_runs(). The value is 0 for the first reading.
/// @return n x m [unit].
[[nodiscard]] Eigen::MatrixXd previous_minus_current(const std::vector<Reading>& readings,
                                                     const Eigen::MatrixXd& response);

/// Computes the effect columns of readings outside the run. The drift continues linearly. The shift
/// after a step applies only to later readings in the block of the step. A block that is not in the
/// run gets the mean of the run's blocks. The column of a memory is 0.
/// @param run     the readings of the run.
/// @return RunEffects::columns for `others`.
[[nodiscard]] Eigen::MatrixXd extrapolate_run_effects(const RunEffects& effects,
                                                      const std::vector<Reading>& run,
                                                      const std::vector<Reading>& others);

/// @return the indices of the readings, ordered by run number. This is the order in which the
///         readings were taken.
[[nodiscard]] std::vector<std::size_t> order_of_runs(const std::vector<Reading>& readings);

/// Returns the position of each of the n readings in the run, from -1/2 to 1/2. The positions
/// follow from the times if all readings have times, otherwise from the order.
[[nodiscard]] Eigen::VectorXd progress_of_run(const std::vector<Reading>& readings);

}  // namespace axiscal
