// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/other_deviations.hpp"

#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "logs/src/phase.hpp"

namespace axiscal {
namespace {

// Computes the modified Allan variance. Each inner sum of m second differences is updated from the
// previous sum.
double modified_variance(std::span<const double> x, std::size_t m, double tau) {
  const std::size_t terms = x.size() - 3 * m + 1;
  double inner = 0.0;
  for (std::size_t i = 0; i < m; ++i) {
    inner += x[i + 2 * m] - 2.0 * x[i + m] + x[i];
  }
  double sum = inner * inner;
  for (std::size_t j = 1; j < terms; ++j) {
    inner += x[j + 3 * m - 1] - 3.0 * x[j + 2 * m - 1] + 3.0 * x[j + m - 1] - x[j - 1];
    sum += inner * inner;
  }
  const auto length = static_cast<double>(m);
  return sum / (2.0 * length * length * tau * tau * static_cast<double>(terms));
}

double hadamard_variance(std::span<const double> x, std::size_t m, double tau) {
  const std::size_t terms = x.size() - 3 * m;
  double sum = 0.0;
  for (std::size_t i = 0; i < terms; ++i) {
    const double third = x[i + 3 * m] - 3.0 * x[i + 2 * m] + 3.0 * x[i + m] - x[i];
    sum += third * third;
  }
  return sum / (6.0 * tau * tau * static_cast<double>(terms));
}

double total_variance(std::span<const double> x, std::size_t m, double tau) {
  const auto n = static_cast<std::ptrdiff_t>(x.size());
  const auto at = [&](std::ptrdiff_t i) {
    if (i < 0) {
      return 2.0 * x.front() - x[static_cast<std::size_t>(-i)];
    }
    return i < n ? x[static_cast<std::size_t>(i)]
                 : 2.0 * x.back() - x[static_cast<std::size_t>(2 * (n - 1) - i)];
  };
  const auto step = static_cast<std::ptrdiff_t>(m);
  double sum = 0.0;
  for (std::ptrdiff_t i = 1; i < n - 1; ++i) {
    const double second = at(i - step) - 2.0 * x[static_cast<std::size_t>(i)] + at(i + step);
    sum += second * second;
  }
  return sum / (2.0 * tau * tau * static_cast<double>(n - 2));
}

}  // namespace

std::string name_of(OtherDeviation which) {
  constexpr std::array<const char*, all_other_deviations.size()> names = {"mdev", "hdev", "totdev"};
  return names[static_cast<std::size_t>(which)];
}

std::optional<OtherDeviation> other_deviation_of(std::string_view name) {
  for (const OtherDeviation which : all_other_deviations) {
    if (name == name_of(which)) {
      return which;
    }
  }
  return std::nullopt;
}

std::vector<double> other_deviations_of_phase(OtherDeviation which,
                                              std::span<const double> phase,
                                              double rate_hz,
                                              std::span<const std::size_t> lengths) {
  const std::size_t n = phase.size();
  if (n < 3) {
    throw DomainError("other_deviations: two samples or more are needed");
  }
  std::vector<double> deviations;
  for (const std::size_t m : lengths) {
    const double tau = static_cast<double>(m) / rate_hz;
    const bool fits = which == OtherDeviation::total ? m + 1 < n : 3 * m < n;
    if (m == 0 || !fits) {
      deviations.push_back(not_a_number);
      continue;
    }
    const double variance = which == OtherDeviation::modified   ? modified_variance(phase, m, tau)
                            : which == OtherDeviation::hadamard ? hadamard_variance(phase, m, tau)
                                                                : total_variance(phase, m, tau);
    deviations.push_back(std::sqrt(variance));
  }
  return deviations;
}

std::vector<double> other_deviations(OtherDeviation which,
                                     std::span<const double> samples,
                                     double rate_hz,
                                     std::span<const std::size_t> lengths) {
  std::vector<double> phase(samples.size() + 1);
  put_phase(samples, rate_hz, std::span(phase).subspan(1));
  return other_deviations_of_phase(which, phase, rate_hz, lengths);
}

}  // namespace axiscal
