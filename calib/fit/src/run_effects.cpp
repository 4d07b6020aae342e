// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/run_effects.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>

#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns an orthonormal basis of the vectors of B elements that sum to 0; B x (B - 1). B is the
// size of `at`. If `without_trend` is true, the vectors also have no linear trend over `at`; the
// result is then B x (B - 2).
Eigen::MatrixXd contrasts(const Eigen::VectorXd& at, bool without_trend) {
  const Eigen::Index B = at.size();
  Eigen::MatrixXd fixed(B, without_trend ? 2 : 1);
  fixed.col(0).setOnes();
  if (without_trend) {
    fixed.col(1) = at.array() - at.mean();
  }
  return orthogonal_complement(fixed);
}

}  // namespace

std::vector<std::size_t> order_of_runs(const std::vector<Reading>& readings) {
  std::vector<std::size_t> order(readings.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return readings[a].run < readings[b].run; });
  return order;
}

Eigen::VectorXd progress_of_run(const std::vector<Reading>& readings) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  const bool timed = std::all_of(readings.begin(), readings.end(),
                                 [](const Reading& reading) { return reading.time_s.has_value(); });
  Eigen::VectorXd at(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    at(i) = timed ? *readings[static_cast<std::size_t>(i)].time_s - *readings.front().time_s
                  : static_cast<double>(i);
  }
  const double span = at.maxCoeff() - at.minCoeff();
  if (!(span > 0.0)) {
    return Eigen::VectorXd::LinSpaced(n, -0.5, 0.5);
  }
  return ((at.array() - at.minCoeff()) / span - 0.5).matrix();
}

namespace {

// The largest number of small blocks. If there are more, the block numbers probably do not mark
// repeated readings, and blocks are ignored.
constexpr std::size_t most_small_blocks = 12;

// Adds a column for each block with few readings, after the columns of the other blocks.
void put_small_blocks(const std::vector<Reading>& readings,
                      const std::map<int, Eigen::Index>& small,
                      RunEffects& effects) {
  const Eigen::Index first = effects.columns.cols();
  const auto more = static_cast<Eigen::Index>(small.size());
  effects.columns.conservativeResize(Eigen::NoChange, first + more);
  effects.columns.rightCols(more).setZero();
  effects.shift_of_block.conservativeResize(Eigen::NoChange, first + more);
  effects.shift_of_block.rightCols(more).setZero();
  for (const auto& [number, column] : small) {
    effects.names.push_back(formatted("shift of block {}", number));
    effects.small_blocks.push_back(number);
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (readings[i].block == number) {
        effects.columns(static_cast<Eigen::Index>(i), first + column) = 1.0;
      }
    }
  }
}

// Adds a column that changes within blocks.
void add_column(const Eigen::VectorXd& column, std::string name, RunEffects& effects) {
  const Eigen::Index count = effects.columns.cols() + 1;
  effects.columns.conservativeResize(column.size(), count);
  effects.columns.rightCols<1>() = column;
  effects.shift_of_block.conservativeResize(static_cast<Eigen::Index>(effects.blocks.size()),
                                            count);
  effects.shift_of_block.rightCols<1>().setZero();
  effects.names.push_back(std::move(name));
}

bool is_behind(const BiasStep& step, const Reading& reading) {
  return reading.block == step.block && reading.run > step.after_run;
}

void put_step(const std::vector<Reading>& readings, int after_run, RunEffects& effects) {
  const auto before = std::find_if(readings.begin(), readings.end(),
                                   [&](const Reading& r) { return r.run == after_run; });
  if (before == readings.end()) {
    return;
  }
  BiasStep step{.after_run = after_run, .block = before->block};
  Eigen::VectorXd column(static_cast<Eigen::Index>(readings.size()));
  for (std::size_t i = 0; i < readings.size(); ++i) {
    column(static_cast<Eigen::Index>(i)) = is_behind(step, readings[i]) ? 1.0 : 0.0;
  }
  step.mean = column.mean();
  effects.step = step;
  add_column(column.array() - step.mean, formatted("step after run {}", after_run), effects);
}

}  // namespace

Eigen::RowVectorXd RunEffects::row(Eigen::Index reading, Eigen::Index axis) const {
  Eigen::RowVectorXd of_axis = columns.row(reading);
  if (memory.size() > 0) {
    of_axis(of_axis.size() - 1) = memory(reading, axis);
  }
  return of_axis;
}

RunEffects RunEffects::of_means(const std::vector<std::vector<Eigen::Index>>& groups) const {
  const auto count = static_cast<Eigen::Index>(groups.size());
  RunEffects means{.columns = Eigen::MatrixXd(count, columns.cols()),
                   .names = names,
                   .blocks = blocks,
                   .shift_of_block = shift_of_block,
                   .has_drift = has_drift,
                   .step = step,
                   .memory = Eigen::MatrixXd(memory.size() > 0 ? count : 0, memory.cols()),
                   .small_blocks = small_blocks};
  for (Eigen::Index g = 0; g < count; ++g) {
    const std::vector<Eigen::Index>& members = groups[static_cast<std::size_t>(g)];
    if (columns.cols() > 0) {
      means.columns.row(g) = columns(members, Eigen::all).colwise().mean();
    }
    if (memory.size() > 0) {
      means.memory.row(g) = memory(members, Eigen::all).colwise().mean();
    }
  }
  return means;
}

Eigen::MatrixXd previous_minus_current(const std::vector<Reading>& readings,
                                       const Eigen::MatrixXd& response) {
  const std::vector<std::size_t> order = order_of_runs(readings);
  Eigen::MatrixXd changes = Eigen::MatrixXd::Zero(response.rows(), response.cols());
  for (std::size_t at = 1; at < order.size(); ++at) {
    const auto i = static_cast<Eigen::Index>(order[at]);
    changes.row(i) = response.row(static_cast<Eigen::Index>(order[at - 1])) - response.row(i);
  }
  return changes;
}

void add_memory(const std::vector<Reading>& readings,
                const Eigen::MatrixXd& response,
                RunEffects& effects) {
  add_column(Eigen::VectorXd::Zero(response.rows()), "memory", effects);
  effects.memory = previous_minus_current(readings, response);
}

RunEffects run_effects(const std::vector<Reading>& readings,
                       const Eigen::MatrixXd& weights,
                       EffectSetup setup) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  const Eigen::VectorXd progress = progress_of_run(readings);
  RunEffects effects;
  effects.has_drift = setup.drift;
  struct Block {
    Eigen::ArrayXd readings;  // number of readings that each axis uses
    double count = 0.0;
    double progress = 0.0;
  };
  std::map<int, Block> seen;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    Block& block = seen[readings[i].block];
    if (block.count == 0.0) {
      block.readings = Eigen::ArrayXd::Zero(weights.cols());
    }
    block.readings += (weights.row(row).transpose().array() > 0.0).cast<double>();
    block.count += 1.0;
    block.progress += progress(row);
  }
  // A block with few readings contains repeated readings. It gets its own bias, which is not part
  // of the scatter of the blocks' biases.
  std::map<int, Eigen::Index> small;  // block number and column index of each small block
  std::erase_if(seen, [&](const auto& one) {
    const bool is_small = one.second.readings.minCoeff() < fewest_readings_of_block;
    if (is_small) {
      small.emplace(one.first, static_cast<Eigen::Index>(small.size()));
    }
    return is_small;
  });
  effects.columns.resize(n, 0);
  if (setup.blocks && (seen.size() > 1 || (!seen.empty() && !small.empty())) &&
      small.size() <= most_small_blocks) {
    Eigen::VectorXd at(static_cast<Eigen::Index>(seen.size()));
    for (const auto& [number, block] : seen) {
      at(static_cast<Eigen::Index>(effects.blocks.size())) = block.progress / block.count;
      effects.blocks.push_back(number);
    }
    if (seen.size() == 1) {
      effects.shift_of_block.resize(1, 0);
    } else if (seen.size() <= most_block_columns) {
      // With two blocks, the only contrast is a linear trend, so the trend is not removed.
      effects.shift_of_block = contrasts(at, effects.has_drift && at.size() > 2);
    } else {
      effects.shift_of_block.resize(at.size(), 0);
    }
    effects.columns.resize(n, effects.shift_of_block.cols());
    for (Eigen::Index i = 0; i < n; ++i) {
      const int number = readings[static_cast<std::size_t>(i)].block;
      const auto found = std::lower_bound(effects.blocks.begin(), effects.blocks.end(), number);
      if (found != effects.blocks.end() && *found == number) {
        effects.columns.row(i) = effects.shift_of_block.row(found - effects.blocks.begin());
      } else {
        effects.columns.row(i).setZero();
      }
    }
    for (Eigen::Index j = 0; j < effects.columns.cols(); ++j) {
      effects.names.push_back(formatted("shift of blocks {}", j + 1));
    }
    put_small_blocks(readings, small, effects);
  }
  if (setup.step_after_run) {
    put_step(readings, *setup.step_after_run, effects);
  }
  if (effects.has_drift) {
    add_column(progress, "drift", effects);
  }
  return effects;
}

namespace {

// Returns the interpolated index of a number in a sorted list. Outside the list, the index
// continues with slope 1.
double place_among(const std::vector<double>& numbers, double number) {
  const auto above = std::upper_bound(numbers.begin(), numbers.end(), number);
  if (above == numbers.begin()) {
    return number - numbers.front();
  }
  const double below = *(above - 1);
  const auto place = static_cast<double>(above - 1 - numbers.begin());
  return above == numbers.end() ? place + number - below
                                : place + (number - below) / (*above - below);
}

}  // namespace

Eigen::MatrixXd extrapolate_run_effects(const RunEffects& effects,
                                        const std::vector<Reading>& run,
                                        const std::vector<Reading>& others) {
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(others.size()), effects.columns.cols());
  if (columns.cols() == 0) {
    return columns;
  }
  // The position of a reading relative to the run, from -1/2 to 1/2 within the run. It is computed
  // from the times. Without times, it is computed from the reading's place among the sorted run
  // numbers.
  const bool timed =
      std::all_of(run.begin(), run.end(), [](const Reading& r) { return r.time_s; }) &&
      std::all_of(others.begin(), others.end(), [](const Reading& r) { return r.time_s; });
  std::vector<double> whens;
  for (const Reading& r : run) {
    whens.push_back(timed ? *r.time_s : static_cast<double>(r.run));
  }
  std::sort(whens.begin(), whens.end());
  const double span = timed ? whens.back() - whens.front() : static_cast<double>(run.size()) - 1.0;
  const auto at = [&](const Reading& r) {
    return timed ? *r.time_s - whens.front() : place_among(whens, static_cast<double>(r.run));
  };
  for (std::size_t i = 0; i < others.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto block = std::find(effects.blocks.begin(), effects.blocks.end(), others[i].block);
    if (block != effects.blocks.end()) {
      columns.row(row) = effects.shift_of_block.row(block - effects.blocks.begin());
    }
    const auto small =
        std::find(effects.small_blocks.begin(), effects.small_blocks.end(), others[i].block);
    if (small != effects.small_blocks.end()) {
      columns(row, effects.block_columns() + (small - effects.small_blocks.begin())) = 1.0;
    }
    if (effects.step) {
      columns(row, effects.step_column()) =
          (is_behind(*effects.step, others[i]) ? 1.0 : 0.0) - effects.step->mean;
    }
    if (effects.has_drift && span > 0.0) {
      columns(row, effects.drift_column()) = at(others[i]) / span - 0.5;
    }
  }
  return columns;
}

}  // namespace axiscal
