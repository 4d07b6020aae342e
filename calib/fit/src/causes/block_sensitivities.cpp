// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/src/causes/causes.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The results of separate fits of the blocks. Each block has its own biases and sensitivities.
struct BlockFits {
  std::vector<Eigen::Matrix3Xd> S;             // 3 x m for each block: the sensitivities
  std::vector<Eigen::MatrixXd> unit_variance;  // 3 x m for each block: variances of the elements of
                                               // S, for noise of variance 1
  Eigen::VectorXd squares;                     // m: sums of squares of the residuals
  Eigen::VectorXd free;                        // m: degrees of freedom of the residuals

  // Returns the blocks that determine an element of S well. A block without a pair of opposite
  // faces determines some elements only through the slope of the table.
  [[nodiscard]] std::vector<std::size_t> blocks_that_determine(Eigen::Index component,
                                                               Eigen::Index axis) const {
    constexpr double worse = 9.0;  // limit of a block's variance / smallest variance
    double least = unit_variance.front()(component, axis);
    for (const Eigen::MatrixXd& own : unit_variance) {
      least = std::min(least, own(component, axis));
    }
    std::vector<std::size_t> blocks;
    for (std::size_t b = 0; b < S.size(); ++b) {
      if (unit_variance[b](component, axis) <= worse * least) {
        blocks.push_back(b);
      }
    }
    return blocks;
  }
};

// The weighted mean of one element of S over the blocks that determine it. The weights are those of
// DerSimonian and Laird (1986); they include the noise of a block and the scatter between blocks.
// The variance of the mean is that of Hartung and Knapp (2001). If all blocks are equally accurate,
// the result is the plain mean with its usual variance.
struct EntryMean {
  double mean = 0.0;
  double variance = 0.0;  // variance of the mean, from the scatter of the blocks
  double within = 0.0;    // variance of the mean, from the readings' noise
  // Sum over the blocks: squared deviation from the mean, divided by the variance of the noise.
  double chi_square = 0.0;
  double blocks = 0.0;  // number of blocks
  [[nodiscard]] double mean_square() const { return blocks * variance; }
};

EntryMean mean_of_entry(const BlockFits& fits,
                        Eigen::Index component,
                        Eigen::Index axis,
                        double s2) {
  const std::vector<std::size_t> blocks = fits.blocks_that_determine(component, axis);
  const auto B = static_cast<double>(blocks.size());
  Eigen::ArrayXd x(static_cast<Eigen::Index>(blocks.size()));
  Eigen::ArrayXd v(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const std::size_t b = blocks[static_cast<std::size_t>(i)];
    x(i) = fits.S[b](component, axis);
    v(i) = std::max(s2 * fits.unit_variance[b](component, axis), 1e-300);
  }
  const auto mean_by = [&](const Eigen::ArrayXd& w) { return (w * x).sum() / w.sum(); };
  Eigen::ArrayXd w = v.inverse();
  EntryMean entry{.mean = mean_by(w), .within = 1.0 / w.sum(), .blocks = B};
  if (blocks.size() < 2) {
    return entry;
  }
  entry.chi_square = (w * (x - entry.mean).square()).sum();
  const double between =
      std::max((entry.chi_square - (B - 1.0)) / (w.sum() - w.square().sum() / w.sum()), 0.0);
  w = (v + between).inverse();
  entry.mean = mean_by(w);
  entry.variance = (w * (x - entry.mean).square()).sum() / (B - 1.0) / w.sum();
  return entry;
}

BlockFits fit_blocks(const Fit& run, const Estimate& estimate) {
  const ReadingSet& set = run.set();
  const Eigen::Index m = run.axes();
  BlockFits fits{.S = {},
                 .unit_variance = {},
                 .squares = Eigen::VectorXd::Zero(m),
                 .free = Eigen::VectorXd::Zero(m)};
  struct Own {
    Eigen::Matrix3Xd S;
    Eigen::Index axes = 0;
    Eigen::MatrixXd unit_variance;
    Eigen::VectorXd squares, free;
  };
  std::map<int, Own> blocks;
  for (Eigen::Index k = 0; k < m; ++k) {
    Fit::AxisRows rows = run.rows_of(k);
    const Eigen::Index within = set.effects.columns_within_blocks();
    for (std::size_t i = 0; i < rows.readings.size() && within > 0; ++i) {
      rows.response(static_cast<Eigen::Index>(i)) -= set.effects.row(rows.readings[i], k)
                                                         .tail(within)
                                                         .dot(estimate.effects.col(k).tail(within));
    }
    std::map<int, std::vector<Eigen::Index>> of_block;
    for (std::size_t i = 0; i < rows.readings.size(); ++i) {
      of_block[set.readings[static_cast<std::size_t>(rows.readings[i])].block].push_back(
          static_cast<Eigen::Index>(i));
    }
    const Eigen::Index c = rows.design.cols();
    for (const auto& [block, own] : of_block) {
      constexpr Eigen::Index fewest_left = 2;
      if (static_cast<Eigen::Index>(own.size()) < c + fewest_left) {
        continue;
      }
      const Eigen::VectorXd root = rows.weights(own).cwiseSqrt();
      const Eigen::MatrixXd X = root.asDiagonal() * rows.design(own, Eigen::all);
      const Eigen::VectorXd y = root.cwiseProduct(rows.response(own).matrix());
      const Factor qr(X);
      if (!qr.has_full_rank()) {
        continue;
      }
      Own& one = blocks[block];
      if (one.axes++ == 0) {
        one = {.S = Eigen::Matrix3Xd::Zero(3, m),
               .axes = 1,
               .unit_variance = Eigen::MatrixXd::Zero(3, m),
               .squares = Eigen::VectorXd::Zero(m),
               .free = Eigen::VectorXd::Zero(m)};
      }
      const Eigen::VectorXd estimated = qr.solve(y);
      one.S.col(k) = estimated.segment<3>(1);
      one.unit_variance.col(k) = qr.covariance().diagonal().segment<3>(1);
      one.squares(k) = (y - X * estimated).squaredNorm();
      one.free(k) = static_cast<double>(X.rows() - c);
    }
  }
  for (const auto& [block, own] : blocks) {
    if (own.axes == m) {
      fits.S.push_back(own.S);
      fits.unit_variance.push_back(own.unit_variance);
      fits.squares += own.squares;
      fits.free += own.free;
    }
  }
  return fits;
}

// Elements of S that are tested together.
struct Entries {
  // Each element is a pair: the component of the field, and the axis.
  std::vector<std::pair<Eigen::Index, Eigen::Index>> all;
  double p_value = 1.0;  // probability that the blocks differ this much by chance

  void add(Eigen::Index component, Eigen::Index axis) { all.emplace_back(component, axis); }
};

// Returns the p-value of a test for rotations of S between blocks. Such rotations occur, for
// example, if the instrument is mounted again for each block.
double p_of_turns(const BlockFits& fits, const Eigen::MatrixXd& mean, const Eigen::VectorXd& s2) {
  std::vector<std::size_t> blocks(fits.S.size());  // the blocks that determine all of S
  std::iota(blocks.begin(), blocks.end(), std::size_t{0});
  for (Eigen::Index entry = 0; entry < 9; ++entry) {
    const std::vector<std::size_t> good = fits.blocks_that_determine(entry % 3, entry / 3);
    std::erase_if(blocks, [&](std::size_t b) {
      return std::find(good.begin(), good.end(), b) == good.end();
    });
  }
  if (blocks.size() < 2) {
    return 1.0;
  }
  const auto B = static_cast<double>(blocks.size());
  const Eigen::Matrix3d S = mean.transpose();
  const Eigen::Matrix3d inverse = S.inverse();
  const auto turn_of = [](const Eigen::Matrix3d& W) {
    return Eigen::Vector3d(0.5 * (W(2, 1) - W(1, 2)), 0.5 * (W(0, 2) - W(2, 0)),
                           0.5 * (W(1, 0) - W(0, 1)));
  };
  double squares = 0.0;
  double expected = 0.0;  // mean square of the rotation that the readings' noise causes
  for (const std::size_t b : blocks) {
    squares += turn_of(inverse * (Eigen::Matrix3d(fits.S[b].transpose()) - S)).squaredNorm();
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (Eigen::Index l = 0; l < 3; ++l) {
        Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
        change(k, l) = std::sqrt(s2(k) * fits.unit_variance[b](l, k) / B);
        expected += turn_of(inverse * change).squaredNorm();
      }
    }
  }
  const double free = 3.0 * (B - 1.0);
  return f_upper_p(squares / (B - 1.0) / std::max(expected, 1e-300), free, fits.free.sum());
}

bool add_block_sensitivities(const Fit& run, bool mounts_known, Estimate& estimate) {
  const ReadingSet& set = run.set();
  const Eigen::Index m = run.axes();
  if (set.temperature.order > 0 || set.seen.cols() > 0 || !set.visible.empty() || set.robust) {
    return false;
  }
  BlockFits fits = fit_blocks(run, estimate);
  if (fits.S.size() < 2) {
    return false;
  }
  // The blocks share the fitted directions of the field. The number of parameters of these
  // directions is subtracted in equal parts from the degrees of freedom of the axes.
  fits.free.array() -=
      static_cast<double>(run.column_count() - set.column_count() * m) / static_cast<double>(m);
  Eigen::VectorXd s2 = fits.squares.cwiseQuotient(fits.free);
  for (Eigen::Index k = 0; k < m; ++k) {
    s2(k) = std::max(s2(k), std::pow(set.rounding(k), 2));
  }
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(3, m);
  Eigen::MatrixXd mean_square = Eigen::MatrixXd::Zero(3, m);
  std::vector<EntryMean> entries;  // mean of each element of S; three for each axis
  double fewest_blocks = static_cast<double>(fits.S.size());
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index l = 0; l < 3; ++l) {
      entries.push_back(mean_of_entry(fits, l, k, s2(k)));
      mean(l, k) = entries.back().mean;
      mean_square(l, k) = entries.back().mean_square();
      fewest_blocks = std::min(fewest_blocks, std::max(entries.back().blocks, 2.0));
    }
  }
  const auto entry = [&](Eigen::Index l, Eigen::Index k) -> const EntryMean& {
    return entries[static_cast<std::size_t>(3 * k + l)];
  };
  if (std::none_of(entries.begin(), entries.end(),
                   [](const EntryMean& one) { return one.blocks > 1.0; })) {
    return false;
  }
  estimate.blocks.sensitivity_mean_square = mean_square.transpose();
  estimate.blocks.sensitivity_degrees_of_freedom = fewest_blocks - 1.0;
  // Group 0 has the main sensitivities of all axes, and group 1 the cross-axis terms of all axes.
  // Then each axis has two groups: its main sensitivity, and its cross-axis terms.
  std::vector<Entries> groups(2 + 2 * static_cast<std::size_t>(m));
  for (Eigen::Index k = 0; k < m; ++k) {
    Eigen::Index main = 0;
    mean.col(k).cwiseAbs().maxCoeff(&main);
    for (Eigen::Index l = 0; l < 3; ++l) {
      const std::size_t kind = l == main ? 0 : 1;
      groups[kind].add(l, k);
      groups[2 + 2 * static_cast<std::size_t>(k) + kind].add(l, k);
    }
  }
  for (Entries& group : groups) {
    double sum = 0.0;
    double free_of_blocks = 0.0;
    double free = 0.0;
    for (const auto& [l, k] : group.all) {
      sum += entry(l, k).chi_square;
      free_of_blocks += entry(l, k).blocks - 1.0;
    }
    if (free_of_blocks == 0.0) {
      continue;
    }
    for (Eigen::Index k = 0; k < m; ++k) {
      const bool has = std::any_of(group.all.begin(), group.all.end(),
                                   [&](const auto& one) { return one.second == k; });
      free += has ? fits.free(k) : 0.0;
    }
    group.p_value = f_upper_p(std::max(sum / free_of_blocks, 1e-300), free_of_blocks, free);
  }
  // If the blocks do not differ significantly in a group, the fit with one S for all blocks is
  // kept. It is equally accurate and has shorter intervals.
  constexpr double all_differ_below = 0.25;
  constexpr double one_differs_below = 0.1;
  WiderIntervals wider("block_sensitivities", estimate);
  const Eigen::Index p = set.coefficient_count();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!(groups[g].p_value < (g < 2 ? all_differ_below : one_differs_below))) {
      continue;
    }
    for (const auto& [l, k] : groups[g].all) {
      const EntryMean& one = entry(l, k);
      if (one.blocks >
          1.0) {  // if only one block determines the element, the fit of all readings is better
        estimate.response.sensitivity(k, l) = one.mean;
        wider.widen(p * k + 1 + l, one.variance, one.blocks - 1.0);
        wider.widen(p * k + 1 + l, one.within, fits.free(k));
      }
    }
  }
  ScatterComponent& component = wider.component();
  component.unit = "relative";
  for (Eigen::Index k = 0; k < m; ++k) {
    Eigen::Index main = 0;
    const double size = mean.col(k).cwiseAbs().maxCoeff(&main);
    const EntryMean& one = entry(main, k);
    component.sd(k) = std::sqrt(std::max(one.mean_square() - one.blocks * one.within, 0.0)) / size;
  }
  const double largest = component.sd.maxCoeff();
  wider.put();
  constexpr double beyond_chance = 0.005;
  double least = 1.0;
  for (std::size_t g = 0; g < groups.size(); g += 2) {
    least = std::min(least, groups[g].p_value * (g == 0 ? 1.0 : static_cast<double>(m)));
  }
  if (least < beyond_chance) {
    estimate.notes.push_back(
        {NoteCode::conditions,
         formatted("the sensitivities differ between blocks by {} % (standard deviation); their "
                   "intervals include this scatter",
                   number_text(100.0 * largest, 2))});
  }
  if (m == 3 && !mounts_known && p_of_turns(fits, mean, s2) < beyond_chance) {
    estimate.notes.push_back(
        {NoteCode::seats,
         "the directions of the axes differ between blocks, as if the instrument was mounted again "
         "for each block. The intervals of the cross-axis terms include this difference; if the "
         "instrument was mounted again, add a column 'mount' that numbers the mountings (1, 2, "
         "...), to make these intervals shorter"});
  }
  if (fits.S.size() == 2) {
    estimate.notes.push_back({NoteCode::conditions,
                              "two blocks are too few to show whether the sensitivities are "
                              "repeatable; take four blocks"});
  }
  constexpr double differ = 0.05;
  return least < differ;
}

CountedEstimate counted_block_sensitivities(const ScatterAnalysisInput& run,
                                            CountedEstimate so_far) {
  const std::vector<Reading>& readings = run.judged.set().readings;
  const bool several = std::any_of(readings.begin(), readings.end(), [&](const Reading& reading) {
    return reading.block != readings.front().block;
  });
  if (several && !run.is_transfer()) {
    so_far.gains_differ = add_block_sensitivities(Fit(run.judged, so_far.estimate),
                                                  so_far.mounts_counted, so_far.estimate);
  }
  return so_far;
}

}  // namespace

Cause block_sensitivities_cause() {
  return {.name = "block_sensitivities", .counted = counted_block_sensitivities};
}

}  // namespace axiscal
