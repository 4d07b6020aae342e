// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace axiscal {
namespace {

using Seeds = std::array<std::uint32_t, 3>;
using StateWords = std::array<std::uint32_t, 2 * std::mt19937_64::state_size>;

// Computes the words that std::seed_seq generates from three numbers for an engine with a large
// state ([rand.util.seedseq]). Seeding takes longer than drawing from most streams, so two measures
// make it fast. First, the loop is split into stretches in which no index wraps around, so that it
// needs no remainders. Second, several sequences are computed together. Within one sequence, each
// word depends on the word before it. The processor therefore computes words of different sequences
// in parallel, which takes little longer than computing one sequence.
template <std::size_t count>
class SeedSequences {
 public:
  explicit SeedSequences(const std::array<Seeds, count>& seeds) {
    for (std::size_t s = 0; s < count; ++s) {
      words_[s].fill(0x8b8b8b8bU);
      before_[s] = words_[s].back();
    }
    const auto number = [](std::size_t k) { return static_cast<std::uint32_t>(k); };
    mix(Places(0), [&](std::size_t s) { return number(seeds[s].size()); });
    const std::size_t with_seeds = 1 + seeds.front().size();
    for (std::size_t k = 1; k < with_seeds; ++k) {
      mix(Places(k), [&](std::size_t s) { return number(k) + seeds[s][k - 1]; });
    }
    for_stretches(with_seeds,
                  [&](const Places& at) { mix(at, [&](std::size_t) { return number(at.here); }); });
    for_stretches(0, [&](const Places& at) {
      for (std::size_t s = 0; s < count; ++s) {
        auto& words = words_[s];
        const std::uint32_t r = 1566083941U * mixed(words[at.here] + words[at.near] + before_[s]);
        words[at.near] ^= r;
        before_[s] = r - number(at.here);
        words[at.far] ^= before_[s];
        words[at.here] = before_[s];
      }
    });
  }

  [[nodiscard]] const StateWords& words(std::size_t sequence) const { return words_[sequence]; }

 private:
  static constexpr std::size_t n = std::tuple_size_v<StateWords>;
  static constexpr std::size_t t = 11;  // the standard's value for 623 words or more
  static constexpr std::size_t first = (n - t) / 2;

  // The indices of the three words that one step changes.
  struct Places {
    explicit Places(std::size_t k) : here(k), near((k + first) % n), far((k + first + t) % n) {}

    std::size_t here;
    std::size_t near;
    std::size_t far;
  };

  // Runs the steps k to n - 1 in up to three stretches. Within a stretch, no index wraps around.
  template <typename Step>
  static void for_stretches(std::size_t k, const Step& step) {
    for (const std::size_t end : {n - first - t, n - first, n}) {
      for (Places at(k); at.here < end; ++at.here, ++at.near, ++at.far) {
        step(at);
      }
      k = end;
    }
  }

  template <typename More>
  void mix(const Places& at, const More& more) {
    for (std::size_t s = 0; s < count; ++s) {
      auto& words = words_[s];
      const std::uint32_t r = 1664525U * mixed(words[at.here] ^ words[at.near] ^ before_[s]);
      words[at.near] += r;
      before_[s] = r + more(s);
      words[at.far] += before_[s];
      words[at.here] = before_[s];
    }
  }

  static std::uint32_t mixed(std::uint32_t word) { return word ^ (word >> 27U); }

  std::array<StateWords, count> words_;
  std::array<std::uint32_t, count> before_{};
};

// A seed sequence that copies prepared words into an engine.
struct MadeSequence {
  using result_type = std::uint_least32_t;

  template <typename Iterator>
  void generate(Iterator begin, Iterator /*end*/) const {
    std::copy(words.begin(), words.end(), begin);
  }

  const StateWords& words;
};

}  // namespace

std::uint64_t RandomStream::next() {
  if (!engine_) {
    seed_engines(std::array{this});
  }
  return (*engine_)();
}

void RandomStream::seed_several(const std::array<RandomStream*, 3>& streams) {
  seed_engines(streams);
}

template <std::size_t count>
void RandomStream::seed_engines(const std::array<RandomStream*, count>& streams) {
  std::array<Seeds, count> seeds;
  for (std::size_t s = 0; s < count; ++s) {
    seeds[s] = {static_cast<std::uint32_t>(streams[s]->seed_),
                static_cast<std::uint32_t>(streams[s]->seed_ >> 32U), streams[s]->stream_};
  }
  const SeedSequences<count> sequences(seeds);
  for (std::size_t s = 0; s < count; ++s) {
    MadeSequence made{sequences.words(s)};
    streams[s]->engine_.emplace(made);
  }
}

double RandomStream::uniform() {
  // Returns the middle of one of 2^52 equal parts of (0, 1), without a rounding error.
  return (static_cast<double>(next() >> 12U) + 0.5) * 0x1p-52;
}

double RandomStream::normal() {
  if (spare_normal_) {
    const double value = *spare_normal_;
    spare_normal_.reset();
    return value;
  }
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  const double angle = 2.0 * std::numbers::pi * uniform();
  spare_normal_ = radius * std::sin(angle);
  return radius * std::cos(angle);
}

std::size_t RandomStream::index(std::size_t count) {
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  const std::uint64_t limit = most - most % count;
  std::uint64_t value = next();
  while (value >= limit) {
    value = next();
  }
  return static_cast<std::size_t>(value % count);
}

}  // namespace axiscal
