// SPDX-License-Identifier: Apache-2.0
#include "kernels/turn_integration.hpp"

#include <algorithm>
#include <numeric>

#ifndef AXISCAL_TURN_SUMS  // this file is included once for each instruction set
#define AXISCAL_TURN_SUMS
namespace axiscal {

constexpr std::size_t turn_lanes = 8;

// The results of integrating eight turns (see IntegratedTurn), in rows of eight numbers: 4 rows for
// the attitude, 27 for its derivatives with respect to B, 9 for the integral of R(t).
struct TurnSums {
  std::array<std::array<double, turn_lanes>, 40> values{};
};

}  // namespace axiscal
#endif

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "turn_integration.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// A vector of doubles with the operators of a double, for turn_step.inc.
struct Many {
  using Lanes = hn::CappedTag<double, 8>;
  hn::Vec<Lanes> v;

  static std::size_t width() { return hn::Lanes(Lanes()); }
  HWY_INLINE static Many constant(double value) { return {hn::Set(Lanes(), value)}; }
  HWY_INLINE static Many load(const double* from) { return {hn::LoadU(Lanes(), from)}; }
  HWY_INLINE void store(double* to) const { hn::StoreU(v, Lanes(), to); }
};

HWY_INLINE Many operator+(const Many& a, const Many& b) {
  return {hn::Add(a.v, b.v)};
}
HWY_INLINE Many operator-(const Many& a, const Many& b) {
  return {hn::Sub(a.v, b.v)};
}
HWY_INLINE Many operator*(const Many& a, const Many& b) {
  return {hn::Mul(a.v, b.v)};
}

#include "turn_step.inc"

// Integrates a group of eight turns, one turn in each vector lane. Each sample is 4 x 8 numbers.
void IntegrateGroup(const double* samples, std::size_t steps, const double* B, TurnSums* sums) {
  for (std::size_t first = 0; first < turn_lanes; first += Many::width()) {
    integrate_turns<Many>(samples + first, steps, B, &sums->values[0][first]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace axiscal
HWY_AFTER_NAMESPACE();
#else
#define HWY_ONCE 1
#endif

#if HWY_ONCE
namespace axiscal {
namespace {

struct One {
  double v;

  static std::size_t width() { return 1; }
  static One constant(double value) { return {value}; }
  static One load(const double* from) { return {*from}; }
  void store(double* to) const { *to = v; }
};

One operator+(One a, One b) {
  return {a.v + b.v};
}
One operator-(One a, One b) {
  return {a.v - b.v};
}
One operator*(One a, One b) {
  return {a.v * b.v};
}

#include "turn_step.inc"

void integrate_group_plain(const double* samples,
                           std::size_t steps,
                           const double* B,
                           TurnSums* sums) {
  for (std::size_t lane = 0; lane < turn_lanes; ++lane) {
    integrate_turns<One>(samples + lane, steps, B, &sums->values[0][lane]);
  }
}

IntegratedTurn turn_of(const TurnSums& sums, std::size_t lane) {
  IntegratedTurn turn;
  for (std::size_t i = 0; i < 4; ++i) {
    turn.attitude[i] = sums.values[i][lane];
  }
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t pq = 0; pq < 9; ++pq) {
      turn.sensitivity[row][pq] = sums.values[4 + 9 * row + pq][lane];
    }
    for (std::size_t column = 0; column < 3; ++column) {
      turn.rotation_integral[row][column] = sums.values[31 + 3 * row + column][lane];
    }
  }
  return turn;
}

}  // namespace

PackedTurns::PackedTurns(std::span<const TurnSamples> turns, const std::array<double, 3>& bias)
    : place_(turns.size()) {
  // Turns of similar length are put into the same group.
  std::vector<std::size_t> order(turns.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return turns[a].time_s.size() > turns[b].time_s.size();
  });
  std::size_t count = 0;
  for (std::size_t i = 0; i < order.size(); i += turn_lanes) {
    const std::size_t steps = turns[order[i]].time_s.size();
    groups_.push_back({.steps = steps, .first = count});
    count += 4 * turn_lanes * steps;
  }
  samples_.assign(count, 0.0);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const TurnSamples& turn = turns[order[i]];
    const std::size_t lane = i % turn_lanes;
    double* const of_group = samples_.data() + groups_[i / turn_lanes].first;
    place_[order[i]] = i;
    for (std::size_t s = 0; s < turn.time_s.size(); ++s) {
      double* const at = of_group + 4 * turn_lanes * s + lane;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at[axis * turn_lanes] = turn.rate[axis][s] - bias[axis];
      }
      at[3 * turn_lanes] = s == 0 ? 0.0 : turn.time_s[s] - turn.time_s[s - 1];
    }
  }
}

template <typename Integrator>
std::vector<IntegratedTurn> PackedTurns::integrated_by(const Integrator& integrate_group,
                                                       std::span<const double, 9> B) const {
  std::vector<TurnSums> sums(groups_.size());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    integrate_group(samples_.data() + groups_[g].first, groups_[g].steps, B.data(), &sums[g]);
  }
  std::vector<IntegratedTurn> turns;
  for (const std::size_t place : place_) {
    turns.push_back(turn_of(sums[place / turn_lanes], place % turn_lanes));
  }
  return turns;
}

std::vector<IntegratedTurn> PackedTurns::integrate_plain(std::span<const double, 9> B) const {
  return integrated_by(integrate_group_plain, B);
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(IntegrateGroup);

std::vector<IntegratedTurn> PackedTurns::integrate(std::span<const double, 9> B) const {
  return integrated_by(AXISCAL_CALL(IntegrateGroup), B);
}
#else
std::vector<IntegratedTurn> PackedTurns::integrate(std::span<const double, 9> B) const {
  return integrate_plain(B);
}
#endif

}  // namespace axiscal
#endif
