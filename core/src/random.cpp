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
// fill than most streams are to draw from: the standard's algorithm ([rand.util.seedseq]) with
// places that go round instead of three remainders a word.
class SeedSequence {
 public:
  using result_type = std::uint_least32_t;

  explicit SeedSequence(const std::array<std::uint32_t, 3>& seeds) : seeds_(seeds) {}

  template <typename Iterator>
  void generate(Iterator begin, Iterator end) const {
    constexpr std::size_t t = 11;  // of 623 words and more
    const auto n = static_cast<std::size_t>(end - begin);
    const std::size_t first = (n - t) / 2;
    std::fill(begin, end, 0x8b8b8b8bU);
    Word<Iterator> here{begin, n, 0};
    Word<Iterator> near{begin, n, first};
    Word<Iterator> far{begin, n, first + t};
    std::uint32_t before = *(end - 1);
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t r = 1664525U * mixed(*here ^ *near ^ before);
      *near += r;
      before = r + static_cast<std::uint32_t>(k == 0 ? seeds_.size() : k);
      before += k > 0 && k <= seeds_.size() ? seeds_[k - 1] : 0U;
      *far += before;
      *here = before;
      here.advance();
      near.advance();
      far.advance();
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t r = 1566083941U * mixed(*here + *near + before);
      *near ^= r;
      before = r - static_cast<std::uint32_t>(k);
      *far ^= before;
      *here = before;
      here.advance();
      near.advance();
      far.advance();
    }
  }

 private:
  template <typename Iterator>
  struct Word {
    std::uint32_t& operator*() const { return begin[place]; }
    void advance() { place = place + 1 == n ? 0 : place + 1; }

    Iterator begin;
    std::size_t n;
    std::size_t place;
  };

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
