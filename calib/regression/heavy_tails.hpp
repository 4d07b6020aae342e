// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>

namespace axiscal {

/// How heavy the tails of a run's noise are, by its own residuals: Student's t of 3, 4, 6, 10, 30
/// degrees of freedom and normal noise, each weighted by how well it describes them. A residual
/// that stands out is then judged by the company it keeps.
///
/// @par Source
/// Lange, Little & Taylor, JASA 84 (1989) 881-896 (t noise in regression).
class NoiseTails {
 public:
  /// Takes a residual of the others, in its standard deviation.
  void add(double z) { change(z, 1.0); }

  /// Takes one out again.
  void remove(double z) { change(z, -1.0); }

  static constexpr std::array freedoms = {3.0,  4.0,  6.0,
                                          10.0, 30.0, std::numeric_limits<double>::infinity()};

  /// @return the weight of each, which sum to 1.
  [[nodiscard]] std::array<double, freedoms.size()> weights() const;

  /// @return the probability that one residual is this large or larger, either side.
  [[nodiscard]] double two_sided_p(double t) const;

  /// @return as above, for a single number of degrees of freedom.
  [[nodiscard]] static double two_sided_p_of(double freedom, double t);

 private:
  void change(double z, double sign);

  std::array<double, freedoms.size()> log_likelihood_{};
};

}  // namespace axiscal
