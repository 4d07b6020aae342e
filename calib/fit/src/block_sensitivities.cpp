// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/scaled_qr.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "scatter_components.hpp"

namespace axiscal {
namespace {

// The sensitivities of each block by its own readings, each with its own bias.
struct BlockFits {
  std::vector<Eigen::Matrix3Xd> S;  // of each block, 3 x m
  Eigen::MatrixXd unit_variance;    // 3 x m: mean over the blocks, of noise 1
  Eigen::VectorXd squares;          // m: of the residuals
  Eigen::VectorXd free;             // m: their degrees of freedom
};

BlockFits fit_blocks(const LinearisedRun& run, const Estimate& estimate) {
  const ReadingSet& set = run.set();
  const Eigen::Index m = run.axes();
  BlockFits fits{.unit_variance = Eigen::MatrixXd::Zero(3, m),
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
    LinearisedRun::AxisRows rows = run.rows_of(k);
    if (set.effects.has_drift) {
      rows.response -= set.effects.columns(rows.readings, Eigen::last) *
                       estimate.effects(estimate.effects.rows() - 1, k);
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
      const ScaledQr qr(X);
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
      fits.unit_variance += own.unit_variance;
      fits.squares += own.squares;
      fits.free += own.free;
    }
  }
  fits.unit_variance /= std::max(static_cast<double>(fits.S.size()), 1.0);
  return fits;
}

// Entries of S that are looked at together.
struct Entries {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> all;  // component and axis
  double p_value = 1.0;  // that they differ between blocks so much by chance

  void add(Eigen::Index component, Eigen::Index axis) { all.emplace_back(component, axis); }
};

// How the turns of S between blocks scatter, as an instrument that is mounted anew has them.
double p_of_turns(const BlockFits& fits, const Eigen::MatrixXd& mean, const Eigen::VectorXd& s2) {
  const auto B = static_cast<double>(fits.S.size());
  const Eigen::Matrix3d S = mean.transpose();
  const Eigen::Matrix3d inverse = S.inverse();
  const auto turn_of = [](const Eigen::Matrix3d& W) {
    return Eigen::Vector3d(0.5 * (W(2, 1) - W(1, 2)), 0.5 * (W(0, 2) - W(2, 0)),
                           0.5 * (W(1, 0) - W(0, 1)));
  };
  double squares = 0.0;
  for (const Eigen::Matrix3Xd& own : fits.S) {
    squares += turn_of(inverse * (Eigen::Matrix3d(own.transpose()) - S)).squaredNorm();
  }
  double expected = 0.0;  // by the readings' noise, summed over the three
  for (Eigen::Index k = 0; k < 3; ++k) {
    for (Eigen::Index l = 0; l < 3; ++l) {
      Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
      change(k, l) = std::sqrt(s2(k) * fits.unit_variance(l, k));
      expected += turn_of(inverse * change).squaredNorm();
    }
  }
  const double free = 3.0 * (B - 1.0);
  return f_upper_p(squares / (B - 1.0) / std::max(expected, 1e-300), free, fits.free.sum());
}

}  // namespace

bool add_block_sensitivities(const LinearisedRun& run, bool mounts_known, Estimate& estimate) {
  const ReadingSet& set = run.set();
  const Eigen::Index m = run.axes();
  if (set.temperature.order > 0 || set.seen.cols() > 0 || !set.visible.empty() || set.robust) {
    return false;
  }
  BlockFits fits = fit_blocks(run, estimate);
  if (fits.S.size() < 2) {
    return false;
  }
  const auto B = static_cast<double>(fits.S.size());
  // The field's directions are fitted to all of them.
  fits.free.array() -=
      static_cast<double>(run.column_count() - set.column_count() * m) / static_cast<double>(m);
  Eigen::VectorXd s2 = fits.squares.cwiseQuotient(fits.free);
  for (Eigen::Index k = 0; k < m; ++k) {
    s2(k) = std::max(s2(k), std::pow(set.rounding(k), 2));
  }
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(3, m);
  for (const Eigen::Matrix3Xd& own : fits.S) {
    mean += own / B;
  }
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(3, m);
  for (const Eigen::Matrix3Xd& own : fits.S) {
    M += (own - mean).cwiseAbs2() / (B - 1.0);
  }
  estimate.sensitivity_mean_square = M.transpose();
  estimate.sensitivity_degrees_of_freedom = B - 1.0;
  // All main entries, all cross entries; and both of each axis alone.
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
    double free = 0.0;
    for (const auto& [l, k] : group.all) {
      sum += M(l, k) / (s2(k) * fits.unit_variance(l, k));
    }
    for (Eigen::Index k = 0; k < m; ++k) {
      const bool has = std::any_of(group.all.begin(), group.all.end(),
                                   [&](const auto& one) { return one.second == k; });
      free += has ? fits.free(k) : 0.0;
    }
    const auto count = static_cast<double>(group.all.size());
    group.p_value = f_upper_p(std::max(sum / count, 1e-300), count * (B - 1.0), free);
  }
  // Where nothing says that they differ one S for all is as good and its intervals are shorter.
  constexpr double all_differ_below = 0.25;
  constexpr double one_differs_below = 0.1;
  WiderIntervals wider("block_sensitivities", estimate);
  const Eigen::Index p = set.coefficient_count();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!(groups[g].p_value < (g < 2 ? all_differ_below : one_differs_below))) {
      continue;
    }
    for (const auto& [l, k] : groups[g].all) {
      estimate.response.sensitivity(k, l) = mean(l, k);
      wider.widen(p * k + 1 + l, M(l, k) / B, B - 1.0);
      wider.widen(p * k + 1 + l, s2(k) * fits.unit_variance(l, k) / B, fits.free(k));
    }
  }
  ScatterComponent& component = wider.component();
  component.unit = "relative";
  for (Eigen::Index k = 0; k < m; ++k) {
    Eigen::Index main = 0;
    const double size = mean.col(k).cwiseAbs().maxCoeff(&main);
    component.sd(k) =
        std::sqrt(std::max(M(main, k) - s2(k) * fits.unit_variance(main, k), 0.0)) / size;
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
         formatted("the sensitivities differ between blocks, by {} % of themselves (standard "
                   "deviation); their intervals count it",
                   number_text(100.0 * largest, 2))});
  }
  if (m == 3 && !mounts_known && p_of_turns(fits, mean, s2) < beyond_chance) {
    estimate.notes.push_back(
        {NoteCode::seats,
         "the axes point otherwise in each block, as when the instrument is mounted anew in the "
         "cube: was it? the cross-axis terms' intervals count it; a column 'mount' that numbers "
         "the mounts makes them shorter"});
  }
  if (B == 2.0) {
    estimate.notes.push_back(
        {NoteCode::conditions, "two blocks do not tell whether the sensitivities repeat: four do"});
  }
  constexpr double differ = 0.05;
  return least < differ;
}

}  // namespace axiscal
