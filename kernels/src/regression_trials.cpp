// SPDX-License-Identifier: Apache-2.0
#include "kernels/regression_trials.hpp"

#ifdef AXISCAL_HIGHWAY
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "regression_trials.cpp"
#include "kernels/src/vector_lanes.hpp"
//
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
//
#include <hwy/contrib/math/math-inl.h>

#include "kernels/src/random_streams.hpp"

HWY_BEFORE_NAMESPACE();
namespace axiscal {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<double, stream_count>;
using Bits = hn::RebindToUnsigned<Lanes>;
using Double = hn::Vec<Lanes>;

// Draws normal random numbers. Each vector lane has its own stream of xoshiro256++.
class NormalLanes {
 public:
  NormalLanes(const RandomStreams& streams, std::size_t first) {
    for (std::size_t word = 0; word < 4; ++word) {
      state_[word] = hn::LoadU(bits_, streams.word(word) + first);
    }
  }

  // Draws two independent normal numbers in each lane, by the method of Box and Muller.
  HWY_INLINE void next(Double& one, Double& other) {
    const Double u = hn::Sub(hn::Set(lanes_, 2.0), one_to_two(word()));  // (0, 1]
    const Double r = hn::Sqrt(hn::Mul(hn::Set(lanes_, -2.0), log_of(u)));
    // The upper bits give an angle within +- pi/4, and the two lowest bits select the quadrant.
    const Word bits = word();
    const Double theta =
        hn::Mul(hn::Sub(one_to_two(bits), hn::Set(lanes_, 1.5)), hn::Set(lanes_, quarter_turn));
    const Double square = hn::Mul(theta, theta);
    const Double sine = hn::Mul(r, hn::Mul(theta, polynomial(square, sine_series)));
    const Double cosine = hn::Mul(r, polynomial(square, cosine_series));
    const Double c = hn::Xor(cosine, hn::BitCast(lanes_, hn::ShiftLeft<63>(bits)));
    const auto swapped = hn::RebindMask(lanes_, hn::TestBit(bits, hn::Set(bits_, 2)));
    one = hn::IfThenElse(swapped, sine, c);
    other = hn::IfThenElse(swapped, c, sine);
  }

 private:
  using Word = hn::Vec<Bits>;

  HWY_INLINE Word word() {
    const Word sum = hn::Add(state_[0], state_[3]);
    const Word result = hn::Add(hn::RotateRight<41>(sum), state_[0]);
    const Word shifted = hn::ShiftLeft<17>(state_[1]);
    state_[2] = hn::Xor(state_[2], state_[0]);
    state_[3] = hn::Xor(state_[3], state_[1]);
    state_[1] = hn::Xor(state_[1], state_[2]);
    state_[0] = hn::Xor(state_[0], state_[3]);
    state_[2] = hn::Xor(state_[2], shifted);
    state_[3] = hn::RotateRight<19>(state_[3]);
    return result;
  }

  [[nodiscard]] HWY_INLINE Double one_to_two(Word bits) const {
    return hn::BitCast(lanes_, hn::Or(hn::ShiftRight<12>(bits), hn::Set(bits_, exponent_of_one)));
  }

  // The logarithm of a number in (0, 1] that is not subnormal: the exponent times ln 2, plus the
  // series of 2 atanh for a mantissa between sqrt(1/2) and sqrt(2).
  [[nodiscard]] HWY_INLINE Double log_of(Double u) const {
    const hn::RebindToSigned<Lanes> integers;
    const auto above = hn::Sub(hn::BitCast(integers, u),
                               hn::Set(integers, std::bit_cast<std::int64_t>(root_half)));
    const auto exponent = hn::ShiftRight<52>(above);
    const Double mantissa =
        hn::BitCast(lanes_, hn::Sub(hn::BitCast(integers, u), hn::ShiftLeft<52>(exponent)));
    const Double below = hn::Sub(mantissa, hn::Set(lanes_, 1.0));
    const Double s = hn::Div(below, hn::Add(mantissa, hn::Set(lanes_, 1.0)));
    const Double of_mantissa = hn::Mul(s, polynomial(hn::Mul(s, s), log_series));
    return hn::MulAdd(hn::ConvertTo(lanes_, exponent), hn::Set(lanes_, std::numbers::ln2),
                      of_mantissa);
  }

  template <std::size_t terms>
  [[nodiscard]] HWY_INLINE Double polynomial(Double x,
                                             const std::array<double, terms>& series) const {
    Double sum = hn::Set(lanes_, series.back());
    for (std::size_t i = terms - 1; i-- > 0;) {
      sum = hn::MulAdd(sum, x, hn::Set(lanes_, series[i]));
    }
    return sum;
  }

  Lanes lanes_;
  Bits bits_;
  Word state_[4];
};

void FillNormals(std::uint64_t seed, std::uint64_t block, std::span<double> values) {
  const Lanes lanes;
  const RandomStreams streams(seed, block);
  for (std::size_t first = 0; first < stream_count; first += hn::Lanes(lanes)) {
    NormalLanes normals(streams, first);
    for (std::size_t i = first; i < values.size(); i += 2 * stream_count) {
      Double one;
      Double other;
      normals.next(one, other);
      hn::StoreU(one, lanes, &values[i]);
      hn::StoreU(other, lanes, &values[i + stream_count]);
    }
  }
}

// Runs one trial in each lane, for a design of four parameters (bias and three sensitivities). The
// estimates stay in registers.
class TrialLanes {
 public:
  TrialLanes(const RegressionTrials& trials, std::size_t first)
      : trials_(trials), first_(first), n_(trials.at.readings) {
    const std::size_t width = hn::Lanes(lanes_);
    readings_ = aligned_values((n_ + 1) * width);
    const std::size_t sums = trials.responses * parameters * 4 * width;
    sums_ = aligned_values(sums);
    std::fill_n(sums_.get(), sums, 0.0);
    for (std::size_t k = 0; k < trials.responses; ++k) {
      for (std::size_t i = 0; i < n_; ++i) {
        double mean = 0.0;
        for (std::size_t j = 0; j < parameters; ++j) {
          mean += trials.at.design[i * parameters + j] * trials.truth[k * parameters + j];
        }
        means_.push_back(mean);
      }
    }
  }

  // Runs the next trial in each lane. Trials at or beyond `count` are not added to the sums.
  void run(NormalLanes& normals, std::size_t trial, std::size_t count) {
    const auto left = static_cast<double>(count) - static_cast<double>(trial + first_);
    const auto counts = hn::Lt(hn::Iota(lanes_, 0.0), hn::Set(lanes_, left));
    for (std::size_t k = 0; k < trials_.responses; ++k) {
      read(normals, k);
      Double estimates[parameters];
      const Double variance = fit(estimates);
      const std::size_t width = hn::Lanes(lanes_);
      double* at = &sums_[k * parameters * 4 * width];
      for (std::size_t j = 0; j < parameters; ++j, at += 4 * width) {
        const Double error =
            hn::Sub(estimates[j], hn::Set(lanes_, trials_.truth[k * parameters + j]));
        const Double square = hn::Mul(error, error);
        const Double u_squared = hn::Mul(variance, hn::Set(lanes_, trials_.unscaled_variance[j]));
        const Double limit =
            hn::Mul(u_squared, hn::Set(lanes_, trials_.coverage_factor * trials_.coverage_factor));
        add(at, hn::IfThenElseZero(counts, error));
        add(at + width, hn::IfThenElseZero(counts, square));
        add(at + 2 * width, hn::IfThenElseZero(counts, u_squared));
        add(at + 3 * width,
            hn::IfThenElseZero(hn::And(counts, hn::Le(square, limit)), hn::Set(lanes_, 1.0)));
      }
    }
  }

  void add_to(std::vector<RegressionTrialSums>& all) const {
    const std::size_t width = hn::Lanes(lanes_);
    for (std::size_t q = 0; q < all.size(); ++q) {
      for (std::size_t lane = 0; lane < width; ++lane) {
        const double* const at = &sums_[q * 4 * width + lane];
        all[q].error += at[0];
        all[q].error_squared += at[width];
        all[q].u_squared += at[2 * width];
        all[q].covered += at[3 * width];
      }
    }
  }

 private:
  HWY_INLINE void read(NormalLanes& normals, std::size_t response) {
    const std::size_t width = hn::Lanes(lanes_);
    const Double sd = hn::Set(lanes_, trials_.noise_sd[response]);
    const double* const means = &means_[response * n_];
    for (std::size_t i = 0; i < n_; i += 2) {
      Double one;
      Double other;
      normals.next(one, other);
      hn::Store(hn::MulAdd(sd, one, hn::Set(lanes_, means[i])), lanes_, &readings_[i * width]);
      if (i + 1 < n_) {
        hn::Store(hn::MulAdd(sd, other, hn::Set(lanes_, means[i + 1])), lanes_,
                  &readings_[(i + 1) * width]);
      }
    }
  }

  // Computes b = P y. Returns the variance s^2 of the residuals y - X b.
  HWY_INLINE Double fit(Double* HWY_RESTRICT b) {
    const std::size_t width = hn::Lanes(lanes_);
    const double* const P = trials_.at.pseudo_inverse.data();
    const double* X = trials_.at.design.data();
    for (std::size_t j = 0; j < parameters; ++j) {
      b[j] = hn::Zero(lanes_);
    }
    for (std::size_t i = 0; i < n_; ++i) {
      const Double y = hn::Load(lanes_, &readings_[i * width]);
      for (std::size_t j = 0; j < parameters; ++j) {
        b[j] = hn::MulAdd(hn::Set(lanes_, P[j * n_ + i]), y, b[j]);
      }
    }
    Double rss = hn::Zero(lanes_);
    for (std::size_t i = 0; i < n_; ++i, X += parameters) {
      Double residual = hn::Load(lanes_, &readings_[i * width]);
      for (std::size_t j = 0; j < parameters; ++j) {
        residual = hn::NegMulAdd(hn::Set(lanes_, X[j]), b[j], residual);
      }
      rss = hn::MulAdd(residual, residual, rss);
    }
    return hn::Mul(rss, hn::Set(lanes_, 1.0 / static_cast<double>(n_ - parameters)));
  }

  HWY_INLINE void add(double* at, Double value) {
    hn::Store(hn::Add(hn::Load(lanes_, at), value), lanes_, at);
  }

  static constexpr std::size_t parameters = 4;

  Lanes lanes_;
  const RegressionTrials& trials_;
  std::size_t first_;
  std::size_t n_;
  std::vector<double> means_;  // readings without noise, X b, of each response
  AlignedValues readings_;     // simulated readings of one response
  AlignedValues sums_;
};

std::vector<RegressionTrialSums> RunTrials(const RegressionTrials& trials,
                                           std::uint64_t seed,
                                           std::uint64_t block,
                                           std::size_t count) {
  const Lanes lanes;
  const RandomStreams streams(seed, block);
  std::vector<RegressionTrialSums> all(trials.responses * trials.at.parameters);
  for (std::size_t first = 0; first < stream_count; first += hn::Lanes(lanes)) {
    NormalLanes normals(streams, first);
    TrialLanes fits(trials, first);
    for (std::size_t trial = 0; trial < count; trial += stream_count) {
      fits.run(normals, trial, count);
    }
    fits.add_to(all);
  }
  return all;
}

}  // namespace HWY_NAMESPACE
}  // namespace axiscal
HWY_AFTER_NAMESPACE();
#else
#include "kernels/src/random_streams.hpp"
#define HWY_ONCE 1
#endif

#if HWY_ONCE
#include <algorithm>
#include <cmath>

namespace axiscal {
namespace {

// Draws the normal random numbers of one stream, a pair at a time.
class PlainNormals {
 public:
  PlainNormals(const RandomStreams& streams, std::size_t stream) {
    for (std::size_t word = 0; word < 4; ++word) {
      state_[word] = streams.word(word)[stream];
    }
  }

  std::array<double, 2> next() {
    const double u = 2.0 - one_to_two(word());
    const double r = std::sqrt(-2.0 * std::log(u));
    const std::uint64_t bits = word();
    const double theta = (one_to_two(bits) - 1.5) * quarter_turn;
    const double sine = r * std::sin(theta);
    const double cosine = (bits & 1U) != 0 ? -r * std::cos(theta) : r * std::cos(theta);
    return (bits & 2U) != 0 ? std::array{sine, cosine} : std::array{cosine, sine};
  }

 private:
  std::uint64_t word() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17U;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  static double one_to_two(std::uint64_t bits) {
    return std::bit_cast<double>((bits >> 12U) | exponent_of_one);
  }

  std::array<std::uint64_t, 4> state_{};
};

void add_trial(const RegressionTrials& trials,
               std::size_t response,
               const std::vector<double>& readings,
               std::vector<RegressionTrialSums>& all) {
  const std::size_t p = trials.at.parameters;
  std::vector<double> estimate(p, 0.0);
  for (std::size_t j = 0; j < p; ++j) {
    for (std::size_t i = 0; i < trials.at.readings; ++i) {
      estimate[j] += trials.at.pseudo_inverse[j * trials.at.readings + i] * readings[i];
    }
  }
  double rss = 0.0;
  for (std::size_t i = 0; i < trials.at.readings; ++i) {
    double residual = readings[i];
    for (std::size_t j = 0; j < p; ++j) {
      residual -= trials.at.design[i * p + j] * estimate[j];
    }
    rss += residual * residual;
  }
  const double variance = rss / static_cast<double>(trials.at.readings - p);
  for (std::size_t j = 0; j < p; ++j) {
    const double error = estimate[j] - trials.truth[response * p + j];
    const double u = std::sqrt(variance * trials.unscaled_variance[j]);
    RegressionTrialSums& sums = all[response * p + j];
    sums.error += error;
    sums.error_squared += error * error;
    sums.u_squared += u * u;
    sums.covered += std::abs(error) <= trials.coverage_factor * u ? 1.0 : 0.0;
  }
}

}  // namespace

void fill_normals_plain(std::uint64_t seed, std::uint64_t block, std::span<double> values) {
  const RandomStreams streams(seed, block);
  for (std::size_t s = 0; s < stream_count; ++s) {
    PlainNormals normals(streams, s);
    for (std::size_t i = s; i < values.size(); i += 2 * stream_count) {
      const std::array<double, 2> pair = normals.next();
      values[i] = pair[0];
      values[i + stream_count] = pair[1];
    }
  }
}

std::vector<RegressionTrialSums> run_regression_trials_plain(const RegressionTrials& trials,
                                                             std::uint64_t seed,
                                                             std::uint64_t block,
                                                             std::size_t count) {
  const RandomStreams streams(seed, block);
  std::vector<RegressionTrialSums> all(trials.responses * trials.at.parameters);
  std::vector<double> readings(trials.at.readings);
  for (std::size_t s = 0; s < stream_count; ++s) {
    PlainNormals normals(streams, s);
    for (std::size_t trial = s; trial < count; trial += stream_count) {
      for (std::size_t k = 0; k < trials.responses; ++k) {
        for (std::size_t i = 0; i < trials.at.readings; ++i) {
          readings[i] = 0.0;
          for (std::size_t j = 0; j < trials.at.parameters; ++j) {
            readings[i] += trials.at.design[i * trials.at.parameters + j] *
                           trials.truth[k * trials.at.parameters + j];
          }
        }
        for (std::size_t i = 0; i < trials.at.readings; i += 2) {
          const std::array<double, 2> pair = normals.next();
          readings[i] += trials.noise_sd[k] * pair[0];
          if (i + 1 < trials.at.readings) {
            readings[i + 1] += trials.noise_sd[k] * pair[1];
          }
        }
        add_trial(trials, k, readings, all);
      }
    }
  }
  return all;
}

#ifdef AXISCAL_HIGHWAY
AXISCAL_KERNEL(FillNormals);
AXISCAL_KERNEL(RunTrials);

void fill_normals(std::uint64_t seed, std::uint64_t block, std::span<double> values) {
  AXISCAL_CALL(FillNormals)(seed, block, values);
}

std::vector<RegressionTrialSums> run_regression_trials(const RegressionTrials& trials,
                                                       std::uint64_t seed,
                                                       std::uint64_t block,
                                                       std::size_t count) {
  return trials.at.parameters == 4 ? AXISCAL_CALL(RunTrials)(trials, seed, block, count)
                                   : run_regression_trials_plain(trials, seed, block, count);
}
#else
void fill_normals(std::uint64_t seed, std::uint64_t block, std::span<double> values) {
  fill_normals_plain(seed, block, values);
}

std::vector<RegressionTrialSums> run_regression_trials(const RegressionTrials& trials,
                                                       std::uint64_t seed,
                                                       std::uint64_t block,
                                                       std::size_t count) {
  return run_regression_trials_plain(trials, seed, block, count);
}
#endif

}  // namespace axiscal
#endif
