// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/sensor_temperature.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The quality of a fit with one polynomial order. The order is chosen by comparing such fits.
struct TemperatureOrderTrial {
  int order = 0;
  double aicc = 0.0;                 ///< corrected Akaike's criterion over all axes; less is better
  double lack_of_fit_p_value = 0.0;  ///< smallest p-value of all axes; NaN if not testable
};

/// The range of a temperature sensor's output t during a calibration [unit of t].
struct TemperatureSpan {
  double reference = 0.0;  ///< output t0 at which the coefficients are stated
  double low = 0.0;        ///< lowest t
  double high = 0.0;       ///< highest t

  friend bool operator==(const TemperatureSpan&, const TemperatureSpan&) = default;
};

/// Bias and scale of m axes as functions of the temperature sensor's output t, with
/// d = t - reference. If each axis has its own sensor, d_k = t_k - reference_k:
///
///     bias_k(t) = b_k + bias(k, 0) d + bias(k, 1) d^2 + ...,  scale_k(t) = 1 + scale(k, 0) d + ..
///     v_k = bias_k(t) + scale_k(t) sum_j S_kj f_j
///
/// @par Source
/// method.md, section 6; US 7,467,536.
struct AXISCAL_EXPORT TemperatureResponse {
  std::vector<TemperatureSpan> spans = {{}};  ///< one for all axes, or one for each axis
  Eigen::MatrixXd bias;                       ///< m x order [unit of the readings per power of t]
  Eigen::MatrixXd scale;                      ///< m x order [1 per power of t]
  Eigen::MatrixXd bias_se;                    ///< standard errors of bias; NaN if unknown
  Eigen::MatrixXd scale_se;                   ///< standard errors of scale; NaN if unknown
  /// One fit for each order that was tried; empty if the order was given.
  std::vector<TemperatureOrderTrial> trials;

  [[nodiscard]] bool has_own_sensors() const { return spans.size() > 1; }

  [[nodiscard]] const TemperatureSpan& span_of(Eigen::Index axis) const {
    return spans[spans.size() == 1 ? 0 : static_cast<std::size_t>(axis)];
  }

  /// @return the reference outputs, at which the coefficients are stated.
  [[nodiscard]] SensorTemperature reference() const;

  /// @return bias_k(t) - b_k.
  [[nodiscard]] double bias_shift(Eigen::Index axis, double t) const;

  /// @return scale_k(t).
  [[nodiscard]] double scale_at(Eigen::Index axis, double t) const;

  /// @param axis          0 .. m - 1.
  /// @param reading       v [unit].
  /// @param at_reference  b_k, the bias of the axis [unit].
  /// @param t             temperature output.
  /// @return (v - bias_k(t)) / scale_k(t), the reading without the bias, converted to the reference
  ///         temperature [unit].
  [[nodiscard]] double bias_corrected(Eigen::Index axis,
                                      double reading,
                                      double at_reference,
                                      double t) const {
    return (reading - at_reference - bias_shift(axis, t)) / scale_at(axis, t);
  }

  /// @return true if an output lies outside the calibrated range.
  [[nodiscard]] bool is_extrapolated(const SensorTemperature& t) const;
};

/// @return the text of the common span, for example "25". If each axis has its own sensor, the text
///         contains the span of each axis: "x 25, y 26.1, z 24.8".
/// @param axes  the axes' names.
/// @param text  converts one span to text.
[[nodiscard]] AXISCAL_EXPORT std::string span_text(
    const TemperatureResponse& temperature,
    const std::vector<std::string>& axes,
    const std::function<std::string(const TemperatureSpan&)>& text);

/// Finds the soak levels: groups of temperatures whose width is much smaller than the gaps between
/// the groups.
///
/// @param temperatures  n outputs of a temperature sensor, in any order.
/// @return the level of each temperature, 0 for the coldest; empty if the temperatures do not form
///         levels.
[[nodiscard]] AXISCAL_EXPORT std::vector<int> soak_levels(const std::vector<double>& temperatures);

/// The state of an instrument's temperature in its chamber.
struct SoakState {
  bool steady = false;
  double rate = 0.0;         ///< trend of the output over the window [unit per second]
  double rate_u = 0.0;       ///< standard error of rate, from the scatter about a fitted line
  double remaining_s = 0.0;  ///< time until steady if the approach is exponential; 0 if steady,
                             ///< NaN if unknown
};

/// Tests whether the output of a temperature sensor is steady. A line is fitted to the readings of
/// the last window; its slope is the trend. The output is steady if (|trend| + uncertainty of the
/// trend (95 %)) times `window_s` is at most `tolerance`.
///
/// @param time_s       n times, ascending.
/// @param temperature  outputs at these times, n values.
/// @param window_s     duration of a window [s]; the trend is fitted to the last window.
/// @param tolerance    largest permitted change of the output in one window.
/// @throws DomainError  if sizes differ, times do not ascend, or window or tolerance are not
///                      positive.
[[nodiscard]] AXISCAL_EXPORT SoakState soak_state(std::span<const double> time_s,
                                                  std::span<const double> temperature,
                                                  double window_s,
                                                  double tolerance);

}  // namespace axiscal
