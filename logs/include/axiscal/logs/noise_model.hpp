// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "axiscal/logs/allan.hpp"

namespace axiscal {

/// The kinds of noise that an Allan deviation parts by its slope.
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

/// One coefficient: Q [unit s], N [unit sqrt(s)], B [unit], K [unit / sqrt(s)], R [unit / s].
struct NoiseCoefficient {
  NoiseKind kind = NoiseKind::white;
  double value = 0.0;  ///< 0: the curve shows none
  double low = 0.0;    ///< 95 % interval; if the value is 0, `high` is the limit
  double high = 0.0;
};

/// The noise coefficients of a sensor from its Allan deviation curve.
struct NoiseModel {
  std::vector<NoiseCoefficient> coefficients;  ///< one for every kind
  /// How likely the curve is so far from the five kinds by chance, from `from_tau_s` on;
  /// NaN where the points are too few to tell.
  double p_value = 1.0;
  double from_tau_s = 0.0;  ///< the shortest tau that was fitted; below a filter shows, say
  double model_error =
      0.0;  ///< of the deviation, relative: by how much the kinds do not describe it
  /// N comes from a stretch of the curve with the slope of white noise, because the joint fit gave
  /// a smaller N.
  bool white_by_stretch = false;

  [[nodiscard]] double coefficient(NoiseKind kind) const;

  /// @return the fitted Allan deviation.
  [[nodiscard]] double deviation_at(double tau_s) const;
};

/// Fits the sum of the five kinds to a curve, at octaves of tau. It minimises the deviance of the
/// Allan variances, each distributed as chi^2 with nu degrees of freedom (2 / (2 / nu + e^2) with
/// the model's error e); no coefficient is negative. Of the sets of kinds it takes that with the
/// least deviance + 8 for each kind (10 for a ramp).
///
/// With e = 0 the chi^2 tests whether the kinds of noise describe the curve (p > 0.05). If they do
/// not, up to four of the shortest octaves, which a filter shapes, are left out until they do.
/// Otherwise e is the value for which chi^2 equals its degrees of freedom, with the number of
/// left-out octaves that gives the smallest e. So no point is more certain than the model, and no
/// interval is shorter than +-10 %.
///
/// White noise is always kept. If tau times the Allan variance is constant over four octaves or
/// more (chi^2 with 3 % has p > 0.05, the slope is within 0.1 of -1/2), and the fit gives less than
/// 0.7 of the N of that stretch, N is taken from the stretch, and the other kinds are fitted to the
/// remainder.
///
/// The intervals are by the profile of the deviance over all sets of the other kinds. Points of one
/// curve are correlated, so the deviance may rise by 10 to 13, found by simulation. A coefficient
/// above 0 whose `low` is 0 is the best description, and not proven.
/// @throws DomainError  for fewer than three points.
/// @par Source
/// IEEE Std 952-2020, annex C; N. El-Sheimy, H. Hou, X. Niu, IEEE Trans. Instrum. Meas. 57 (2008);
/// e: Paule & Mandel, J. Res. NBS 87 (1982) 377-385.
[[nodiscard]] NoiseModel fit_noise(std::span<const AllanPoint> curve);

/// @return the deviation of a curve at tau, between its points and on from its ends straight in
///         logarithms.
/// @throws DomainError  without points.
[[nodiscard]] double deviation_at(std::span<const AllanPoint> curve, double tau_s);

/// One coefficient from the points at which its slope is visible: their geometric mean.
/// @throws DomainError  without points.
[[nodiscard]] double coefficient_by_slope(NoiseKind kind, std::span<const AllanPoint> points);

/// How long to dwell on a design point.
struct Dwell {
  double best_s = 0.0;      ///< position of the minimum: longer averages are not better
  double deviation = 0.0;   ///< there [unit]
  double sensible_s = 0.0;  ///< the shortest within 10 % of that
  double sensible_deviation = 0.0;
  bool beyond_record = false;  ///< true if the curve still falls at the end of the record
};

/// Where the curve itself is least, of its points that are known well enough (20 degrees of
/// freedom; else all).
/// @throws DomainError  without points.
[[nodiscard]] Dwell best_dwell(std::span<const AllanPoint> curve);

}  // namespace axiscal
