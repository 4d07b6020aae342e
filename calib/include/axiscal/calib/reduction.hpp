// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

struct ReductionOptions {
  std::optional<double>
      magnitude;  ///< F where readings are taken [field unit]; default: the record's
  InclinationOptions inclination;  ///< the convention is the record's
};

/// What a reading of three or more axes says.
struct ReducedReading {
  Eigen::Vector3d field_in_sensor = Eigen::Vector3d::Zero();  ///< f_hat [field unit]
  double residual = 0.0;                                      ///< |f_hat| - F [field unit]
  DerivedValues derived;                                      ///< as the kind of instrument says
};

/// What a reading of one axis says where there are fewer than three.
struct ReducedAxis {
  double component = 0.0;  ///< field along the sensing axis [field unit]
  double angle_rad = 0.0;  ///< of the axis above the horizontal; 0 where the kind has none
  bool clamped = false;
};

/// The way back: raw readings to field components, residual and derived quantities.
///
///     f_hat = S^-1 (v - b);   m > 3: least squares weighted by 1 / s_k^2
///
/// After construction nothing is allocated: fit for use in real time.
///
/// @code
/// const axiscal::Reducer reducer(axiscal::read_calibration("cal.json"));
/// const axiscal::ReducedReading reduced = reducer.reduce(std::array{0.01, -0.02, 0.99});
/// @endcode
///
/// @par Source
/// METHOD section 7; US 7,467,536.
class Reducer {
 public:
  /// @throws DomainError  if m >= 3 axes do not determine the field (S of rank below 3), an axis
  ///                      has no sensitivity, or the magnitude is not positive.
  explicit Reducer(const Calibration& calibration, const ReductionOptions& options = {});

  /// @return m, the number of readings that reduce() takes.
  [[nodiscard]] std::size_t axis_count() const { return bias_.size(); }

  /// @return whether reduce() may be called: three or more axes.
  [[nodiscard]] bool gives_components() const { return bias_.size() >= 3; }

  [[nodiscard]] const InstrumentKind& kind() const { return *kind_; }

  /// @return F, the field's magnitude that residuals and angles refer to [field unit].
  [[nodiscard]] double magnitude() const { return magnitude_; }

  /// @param readings  axis_count() finite readings [unit], in the order of the axes; m >= 3.
  [[nodiscard]] ReducedReading reduce(std::span<const double> readings) const noexcept;

  /// The field along one sensing axis: (v - b) / |S_k|; any m.
  ///
  /// @param axis     0 .. m - 1.
  /// @param reading  [unit], finite.
  [[nodiscard]] ReducedAxis reduce_axis(std::size_t axis, double reading) const noexcept;

  /// What two axes leave open: the field's component square to both, known up to its sign.
  ///
  /// @param first, second  readings of the two axes [unit], finite; m = 2.
  /// @return its magnitude, sqrt(F^2 - |part that the axes see|^2) [field unit]; 0 where the axes
  ///         see more than F.
  /// @throws DomainError  if there are not two axes.
  [[nodiscard]] double unseen_component(double first, double second) const;

 private:
  const InstrumentKind* kind_;
  double magnitude_;
  InclinationOptions inclination_;
  std::vector<double> bias_;
  std::vector<double> length_;            // |S_k|
  std::vector<Eigen::Vector3d> inverse_;  // columns of the pseudo-inverse of S
};

}  // namespace axiscal
