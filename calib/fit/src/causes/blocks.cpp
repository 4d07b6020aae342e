// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns for each block and axis the bias of the block minus the mean over all blocks; B x m.
Eigen::MatrixXd shifts_of_blocks(const ReadingSet& set, const Estimate& estimate) {
  const RunEffects& effects = set.effects;
  if (effects.has_block_columns()) {
    return effects.shift_of_block * estimate.effects;
  }
  std::map<int, Eigen::Index> place;
  for (const int block : effects.blocks) {
    place.emplace(block, static_cast<Eigen::Index>(place.size()));
  }
  const auto count = static_cast<Eigen::Index>(place.size());
  const AxisDesigns designs(set, estimate.field);
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(count, set.axis_count());
  Eigen::MatrixXd weights = sums;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto found = place.find(set.readings[static_cast<std::size_t>(i)].block);
    if (found == place.end()) {
      continue;  // the reading belongs to a small block, which is not counted
    }
    const Eigen::Index block = found->second;
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      const Eigen::MatrixXd& base = designs.of(k);
      double left = set.response(i, k) - estimate.response.bias(k) -
                    estimate.response.sensitivity.row(k).dot(base.row(i).segment<3>(1));
      for (std::size_t a = 0; a < estimate.also.size(); ++a) {
        left -= estimate.also[a].row(k).dot(
            base.row(i).segment<3>(4 + 3 * static_cast<Eigen::Index>(a)));
      }
      const Eigen::Index within = effects.columns_within_blocks();
      if (within > 0) {
        left -= effects.row(i, k).tail(within).dot(estimate.effects.col(k).tail(within));
      }
      sums(block, k) += set.weights(i, k) * left;
      weights(block, k) += set.weights(i, k);
    }
  }
  Eigen::MatrixXd shifts = sums.cwiseQuotient(weights);
  shifts.rowwise() -= shifts.colwise().mean().eval();
  return shifts;
}

// The mean square of the blocks' biases about their mean, for one axis.
struct BlockSquare {
  double mean_square = 0.0;
  double degrees_of_freedom = 0.0;
};

// Pools the mean square of this run with that of earlier calibrations, unless the mean square of
// this run is significantly larger.
BlockSquare pooled(const BlockSquare& own, const BlockSquare& earlier) {
  constexpr double too_large = 0.95;
  if (!(own.degrees_of_freedom > 0.0)) {
    return earlier;
  }
  if (!(earlier.degrees_of_freedom > 0.0) ||
      own.mean_square > earlier.mean_square * f_quantile(too_large, own.degrees_of_freedom,
                                                         earlier.degrees_of_freedom)) {
    return own;
  }
  const double freedom = own.degrees_of_freedom + earlier.degrees_of_freedom;
  return {.mean_square = (own.degrees_of_freedom * own.mean_square +
                          earlier.degrees_of_freedom * earlier.mean_square) /
                         freedom,
          .degrees_of_freedom = freedom};
}

// Adds the scatter of the blocks to the uncertainty of the biases. The mean square of the blocks'
// biases about their mean includes the scatter of the readings.
void add_block_scatter(const ReadingSet& set, const ProcessScatter* process, Estimate& estimate) {
  const RunEffects& effects = set.effects;
  const double nu = effects.degrees_of_freedom_of_blocks();
  const bool several = nu > 0.0;
  if (!several && process == nullptr) {
    return;
  }
  const double blocks = several ? static_cast<double>(effects.blocks.size()) : 1.0;
  if (several) {
    estimate.blocks.degrees_of_freedom = nu;
    estimate.blocks.mean_square =
        shifts_of_blocks(set, estimate).colwise().squaredNorm().transpose() / nu;
  }
  FitStatistics& statistics = estimate.statistics;
  WiderIntervals wider("blocks", estimate);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    BlockSquare all;
    if (several) {
      all = {.mean_square = estimate.blocks.mean_square(k), .degrees_of_freedom = nu};
    }
    if (process != nullptr) {
      const double own = all.degrees_of_freedom;
      all = pooled(all, {.mean_square = process->mean_square(k),
                         .degrees_of_freedom = process->degrees_of_freedom});
      estimate.blocks.earlier =
          all.degrees_of_freedom > own ? process->records : estimate.blocks.earlier;
    }
    const Eigen::Index at = set.coefficient_count() * k;
    const double within = statistics.covariance(at, at);
    wider.component().sd(k) = std::sqrt(std::max(all.mean_square - blocks * within, 0.0));
    wider.widen(at, all.mean_square / blocks, all.degrees_of_freedom);
  }
  wider.put();
  if (process != nullptr && estimate.blocks.earlier == 0) {
    estimate.notes.push_back({NoteCode::conditions,
                              "the blocks differ much more than in earlier calibrations, so the "
                              "scatter of the earlier calibrations is not used"});
  } else if (process != nullptr) {
    estimate.notes.push_back(
        {NoteCode::conditions,
         formatted("the intervals of the biases include their changes between blocks in {} earlier "
                   "calibrations ({} degrees of freedom)",
                   process->records, number_text(process->degrees_of_freedom, 3))});
  } else if (effects.blocks.size() == 2) {
    estimate.notes.push_back(
        {NoteCode::conditions,
         "the intervals of the biases allow for differences between blocks. Two blocks are too few "
         "to estimate these differences well, so the intervals are wide. With three blocks they "
         "are "
         "about 2.5 times shorter, with four blocks about 3 times"});
  }
}

CountedEstimate counted_blocks(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  const std::optional<ProcessScatter>& earlier = run.experiment.fit.process;
  add_block_scatter(run.judged.set(), earlier ? &*earlier : nullptr, so_far.estimate);
  return so_far;
}

}  // namespace

Cause blocks_cause() {
  return {.name = "blocks", .counted = counted_blocks};
}

}  // namespace axiscal
