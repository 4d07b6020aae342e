// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "axiscal/logs/allan.hpp"

namespace axiscal {

/// Kinds of noise. Each one has its own slope in the log-log plot of the Allan deviation over tau.
/// The comments state this slope and the Allan deviation.
enum class NoiseKind {
  quantisation,      ///< slope -1: Q sqrt(3) / tau
  white,             ///< slope -1/2: N / sqrt(tau); angle or velocity random walk
  bias_instability,  ///< slope 0: B sqrt(2 ln 2 / pi)
  random_walk,       ///< slope +1/2: K sqrt(tau / 3); rate random walk
  ramp,              ///< slope +1: R tau / sqrt(2)
};

inline constexpr std::array all_noise_kinds = {NoiseKind::quantisation, NoiseKind::white,
                                               NoiseKind::bias_instability, NoiseKind::random_walk,
                                               NoiseKind::ramp};

/// @return "quantisation", "white", "bias_instability", "random_walk", "ramp".
[[nodiscard]] std::string noise_name(NoiseKind kind);

/// @return the Allan variance at tau for a coefficient of 1.
[[nodiscard]] double allan_variance_of(NoiseKind kind, double tau_s);

/// The coefficient of one kind of noise: Q [unit s], N [unit sqrt(s)], B [unit], K [unit / sqrt(s)]
/// or R [unit / s].
struct NoiseCoefficient {
  NoiseKind kind = NoiseKind::white;
  double value = 0.0;  ///< the coefficient; 0 if the curve does not show this noise
  double low = 0.0;    ///< lower end of the 95 % confidence interval
  double high = 0.0;   ///< upper end of the interval; an upper bound if `value` is 0
};

/// The noise coefficients of a sensor from its Allan deviation curve.
struct NoiseModel {
  std::vector<NoiseCoefficient> coefficients;  ///< one for every kind
  /// p-value of the chi^2 test of whether a sum of the five kinds of noise describes the curve at
  /// tau >= `from_tau_s`; NaN if there are too few points.
  double p_value = 1.0;
  double from_tau_s = 0.0;  ///< shortest tau that is fitted; a filter may shape the curve below it
  /// Assumed relative error of the modelled deviations; 0 if the kinds of noise describe the curve.
  double model_error = 0.0;
  /// True if the coefficient N of white noise was taken from a part of the curve that has the slope
  /// of white noise, because the fit of all kinds of noise gave a much smaller N.
  bool white_by_stretch = false;

  [[nodiscard]] double coefficient(NoiseKind kind) const;

  /// @return the fitted Allan deviation.
  [[nodiscard]] double deviation_at(double tau_s) const;
};

/// Fits the sum of the five kinds of noise to a curve, at octaves of tau. It minimises the deviance
/// of the Allan variances. Each variance has a chi^2 distribution with 2 / (2 / nu + e^2) degrees
/// of freedom. Here nu are the degrees of freedom of the point, and e is the relative error of the
/// modelled variance. No coefficient is negative. The chosen set of kinds has the smallest sum of
/// the deviance and a penalty of 8 for each kind (10 for a ramp).
///
/// The fit begins with e = 0. A chi^2 test then shows whether the kinds of noise describe the curve
/// (p > 0.05). If not, up to four of the shortest octaves are left out, because a filter may shape
/// them. If no such fit passes the test, e is increased until chi^2 equals its degrees of freedom.
/// Of the fits with different numbers of left-out octaves, the one with the smallest e is used. In
/// this case no interval is narrower than +-10 %.
///
/// A curve shows white noise directly if it has a stretch of four octaves or more over which tau
/// times the Allan variance is constant. The product is regarded as constant if a chi^2 test that
/// allows an error of 3 % of the deviations has p > 0.05, and the slope of the deviation is within
/// 0.1 of -1/2. If the fitted N is less than 0.7 times the N of the stretch, N is taken from the
/// stretch, and the other kinds are fitted to the remaining variances.
///
/// The interval of a coefficient is found from the deviance as a function of this coefficient. For
/// each of its values, the deviance is minimised over the other coefficients and over all sets of
/// the other kinds. The interval contains the values at which this minimum exceeds the smallest one
/// by at most a limit of 10 to 13. The limits were found by simulation, because the points of a
/// curve are correlated. If a coefficient is positive and its `low` is 0, the best model contains
/// this noise, but a model without it is also possible.
/// @throws DomainError  for fewer than three points.
/// @par Source
/// IEEE Std 952-2020, annex C; N. El-Sheimy, H. Hou, X. Niu, IEEE Trans. Instrum. Meas. 57 (2008);
/// e: Paule & Mandel, J. Res. NBS 87 (1982) 377-385.
[[nodiscard]] NoiseModel fit_noise(std::span<const AllanPoint> curve);

/// @return the deviation of a curve at tau, interpolated and extrapolated linearly in logarithms.
/// @throws DomainError  if the curve is empty.
[[nodiscard]] double deviation_at(std::span<const AllanPoint> curve, double tau_s);

/// Computes one coefficient from points at which the curve has the slope of this kind of noise. The
/// result is the geometric mean of the coefficients of the single points.
/// @throws DomainError  if there are no points.
[[nodiscard]] double coefficient_by_slope(NoiseKind kind, std::span<const AllanPoint> points);

/// How long a reading should be averaged.
struct Dwell {
  double best_s = 0.0;     ///< averaging time with the smallest Allan deviation [s]
  double deviation = 0.0;  ///< Allan deviation at best_s [unit]
  /// Shortest useful averaging time. From it to best_s, the Allan deviation is at most 10 % above
  /// `deviation`.
  double sensible_s = 0.0;
  double sensible_deviation = 0.0;  ///< Allan deviation at sensible_s [unit]
  bool beyond_record = false;       ///< true if the curve still falls at the end of the record
};

/// Finds the averaging time with the smallest deviation. Only the points before the first one with
/// fewer than 20 degrees of freedom are used. If these are fewer than three points, all points are
/// used.
/// @throws DomainError  if the curve is empty.
[[nodiscard]] Dwell best_dwell(std::span<const AllanPoint> curve);

}  // namespace axiscal
