// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>

namespace axiscal {

/// The distribution of a run's noise, estimated from its residuals. It is a mixture of six
/// distributions: Student's t with 3, 4, 6, 10 and 30 degrees of freedom, and the normal
/// distribution. The weight of each distribution is proportional to its prior times its likelihood.
/// Outliers are judged by this mixture.
///
/// @par Source
/// Lange, Little & Taylor, JASA 84 (1989) 881-896 (t noise in regression).
class NoiseTails {
 public:
  /// Adds a residual, divided by its standard deviation.
  void add(double z) { change(z, 1.0); }

  /// Removes a residual that was added.
  void remove(double z) { change(z, -1.0); }

  static constexpr std::array freedoms = {3.0,  4.0,  6.0,
                                          10.0, 30.0, std::numeric_limits<double>::infinity()};

  /// @return the weight of each distribution; the weights sum to 1.
  [[nodiscard]] std::array<double, freedoms.size()> weights() const;

  /// @return the probability that the absolute value of one scaled residual is |t| or more.
  [[nodiscard]] double two_sided_p(double t) const;

  /// @return the probability that the absolute value of Student's t with `freedom` degrees of
  ///         freedom is |t| or more.
  [[nodiscard]] static double two_sided_p_of(double freedom, double t);

 private:
  void change(double z, double sign);

  std::array<double, freedoms.size()> log_likelihood_{};
};

}  // namespace axiscal
