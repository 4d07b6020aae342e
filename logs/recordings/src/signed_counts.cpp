// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/signed_counts.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// A count that was printed unsigned is positive if it is below the first limit, and negative if it
// is at or above the second. Both limits are fractions of 2^bits.
constexpr double positive_below = 0.375;
constexpr double negative_from = 0.625;

struct Counts {
  bool are_counts = true;  // true if all values are whole numbers of 0 or more
  double largest = 0.0;
  bool rises = false, falls = false;
};

Counts counts_of(std::span<const double> values) {
  Counts counts;
  for (std::size_t i = 0; i < values.size() && counts.are_counts; ++i) {
    if (!std::isfinite(values[i])) {
      continue;
    }
    counts.are_counts = values[i] >= 0.0 && values[i] == std::floor(values[i]);
    counts.largest = std::max(counts.largest, values[i]);
    counts.rises = counts.rises || (i > 0 && values[i] > values[i - 1]);
    counts.falls = counts.falls || (i > 0 && values[i] < values[i - 1]);
  }
  return counts;
}

// The fractions of the samples below positive_below, from negative_from on, and between these two.
struct Shares {
  double positive = 0.0, negative = 0.0, between = 0.0;
};

Shares shares_of(std::span<const double> values, double modulus) {
  Shares shares;
  for (const double value : values) {
    const double part = value / modulus;
    (part < positive_below   ? shares.positive
     : part >= negative_from ? shares.negative
                             : shares.between) += 1.0 / static_cast<double>(values.size());
  }
  return shares;
}

}  // namespace

SignedCounts find_signed_counts(const std::vector<std::span<const double>>& samples,
                                int fewest_bits) {
  constexpr double little = 0.02;
  constexpr std::size_t fewest = 12;
  std::vector<Counts> counts;
  double largest = 0.0;
  for (const std::span<const double> values : samples) {
    counts.push_back(counts_of(values));
    const Counts& own = counts.back();
    if (own.are_counts && own.rises && own.falls && values.size() >= fewest) {
      largest = std::max(largest, own.largest);
    }
  }
  SignedCounts found;
  for (const int bits : {12, 14, 16, 24, 32}) {
    const double modulus = std::ldexp(1.0, bits);
    if (bits < fewest_bits || largest >= modulus || largest < negative_from * modulus) {
      continue;
    }
    std::size_t of_both_signs = 0;
    for (std::size_t c = 0; c < samples.size(); ++c) {
      // A column that only rises is a time or a counter.
      if (!counts[c].are_counts || !counts[c].rises || !counts[c].falls) {
        continue;
      }
      const Shares shares = shares_of(samples[c], modulus);
      if (shares.between <= little) {
        found.columns.push_back(c);
        of_both_signs += shares.positive > little && shares.negative > little ? 1U : 0U;
      }
    }
    if (of_both_signs >= 2) {
      found.bits = bits;
      return found;
    }
    found.columns.clear();
  }
  return found;
}

double with_sign(double count, int bits) {
  const double modulus = std::ldexp(1.0, bits);
  return count >= 0.5 * modulus ? count - modulus : count;
}

std::string words_of(const SignedCounts& counts, const std::vector<std::string>& names) {
  std::vector<std::string> own;
  for (const std::size_t column : counts.columns) {
    own.push_back(names[column]);
  }
  const double largest = std::ldexp(1.0, counts.bits) - 1.0;
  return formatted(
      "{}: these columns contain signed counts of {} bits that were printed as unsigned numbers "
      "({} for -1); they are read as signed numbers",
      joined(own), counts.bits, number_text(largest));
}

}  // namespace axiscal
