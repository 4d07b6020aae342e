// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/random.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace axiscal {
namespace {

std::mt19937_64 seeded_engine(std::uint64_t seed, std::uint32_t stream) {
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                         stream};
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
