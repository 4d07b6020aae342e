// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/random.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace axiscal {
namespace {

// What std::seed_seq of three numbers makes for an engine of many words, whose state is dearer to
// fill than most streams are to draw from: the standard's algorithm ([rand.util.seedseq]) in
// stretches in which no place goes round, instead of three remainders a word.
class SeedSequence {
 public:
  using result_type = std::uint_least32_t;

  explicit SeedSequence(const std::array<std::uint32_t, 3>& seeds) : seeds_(seeds) {}

  // @param begin, end  623 words or more, one after another in memory.
  template <typename Iterator>
  void generate(Iterator begin, Iterator end) const {
    const auto n = static_cast<std::size_t>(end - begin);
    std::fill(begin, end, 0x8b8b8b8bU);
    std::uint32_t before = *(end - 1);
    const auto mix = [&](const Places& at, std::uint32_t more) {
      const std::uint32_t r = 1664525U * mixed(begin[at.here] ^ begin[at.near] ^ before);
      begin[at.near] += r;
      before = r + more;
      begin[at.far] += before;
      begin[at.here] = before;
    };
    const auto add = [&](std::size_t k) { return static_cast<std::uint32_t>(k); };
    const std::size_t with_seeds = 1 + seeds_.size();
    mix(Places(0, n), add(seeds_.size()));
    for (std::size_t k = 1; k < with_seeds; ++k) {
      mix(Places(k, n), add(k) + seeds_[k - 1]);
    }
    for_stretches(with_seeds, n, [&](const Places& at) { mix(at, add(at.here)); });
    for_stretches(0, n, [&](const Places& at) {
      const std::uint32_t r = 1566083941U * mixed(begin[at.here] + begin[at.near] + before);
      begin[at.near] ^= r;
      before = r - add(at.here);
      begin[at.far] ^= before;
      begin[at.here] = before;
    });
  }

 private:
  // The words that one step changes, of n.
  struct Places {
    Places(std::size_t k, std::size_t n) : here(k), near(k + first(n)), far(near + t) {
      near -= near < n ? 0 : n;
      far -= far < n ? 0 : n;
    }

    static constexpr std::size_t t = 11;  // of 623 words and more
    static std::size_t first(std::size_t n) { return (n - t) / 2; }

    std::size_t here;
    std::size_t near;
    std::size_t far;
  };

  // Steps k to n - 1, between those at which a place goes round.
  template <typename Step>
  static void for_stretches(std::size_t k, std::size_t n, const Step& step) {
    const std::size_t first = Places::first(n);
    for (const std::size_t end : {n - first - Places::t, n - first, n}) {
      for (Places at(k, n); at.here < end; ++at.here, ++at.near, ++at.far) {
        step(at);
      }
      k = end;
    }
  }

  static std::uint32_t mixed(std::uint32_t word) { return word ^ (word >> 27U); }

  std::array<std::uint32_t, 3> seeds_;
};

std::mt19937_64 seeded_engine(std::uint64_t seed, std::uint32_t stream) {
  SeedSequence sequence(
      {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U), stream});
  return std::mt19937_64(sequence);
}

}  // namespace

std::uint64_t RandomStream::next() {
  if (!engine_) {
    engine_ = seeded_engine(seed_, stream_);
  }
  return (*engine_)();
}

double RandomStream::uniform() {
  // The middle of one of 2^52 equal parts of (0, 1), exactly.
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
