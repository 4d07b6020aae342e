// SPDX-License-Identifier: Apache-2.0
#include "calib/regression/heavy_tails.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "axiscal/calib/distributions.hpp"

namespace axiscal {

void NoiseTails::change(double z, double sign) {
  for (std::size_t v = 0; v < freedoms.size(); ++v) {
    const double nu = freedoms[v];
    const double log_density = std::isinf(nu)
                                   ? -0.5 * (std::log(2.0 * std::numbers::pi) + z * z)
                                   : std::lgamma(0.5 * (nu + 1.0)) - std::lgamma(0.5 * nu) -
                                         0.5 * std::log(nu * std::numbers::pi) -
                                         0.5 * (nu + 1.0) * std::log1p(z * z / nu);
    log_likelihood_[v] += sign * log_density;
  }
}

std::array<double, NoiseTails::freedoms.size()> NoiseTails::weights() const {
  constexpr double prior_of_normal = 0.2;
  constexpr double prior_of_tail = 0.16;
  const double best = *std::max_element(log_likelihood_.begin(), log_likelihood_.end());
  std::array<double, freedoms.size()> all{};
  double sum = 0.0;
  for (std::size_t v = 0; v < freedoms.size(); ++v) {
    all[v] = (std::isinf(freedoms[v]) ? prior_of_normal : prior_of_tail) *
             std::exp(log_likelihood_[v] - best);
    sum += all[v];
  }
  for (double& weight : all) {
    weight /= sum;
  }
  return all;
}

double NoiseTails::two_sided_p_of(double freedom, double t) {
  return std::isinf(freedom) ? std::erfc(std::abs(t) / std::numbers::sqrt2)
                             : student_t_two_sided_p(t, freedom);
}

double NoiseTails::two_sided_p(double t) const {
  const auto all = weights();
  double p = 0.0;
  for (std::size_t v = 0; v < freedoms.size(); ++v) {
    p += all[v] * two_sided_p_of(freedoms[v], t);
  }
  return p;
}

}  // namespace axiscal
