// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/estimation.hpp"
#include "calib/mistakes/src/hypothesis.hpp"

namespace axiscal {

/// Indices of two readings.
using ReadingPair = std::array<std::size_t, 2>;

/// A run that may contain a mistake, with the fit of all readings and the fits without one or two
/// readings.
///
/// If a run has at most `each_is_fitted` readings, a fit is made without each of them. If it has
/// more, fits are made only without the max_candidate_fits() readings whose deletion reduces the
/// sum of squares most, to first order. Therefore the time is linear in the number of readings.
class SuspectRun {
 public:
  static constexpr std::size_t each_is_fitted = 200;

  /// The largest number of deletions that are fitted in a long run. The number is smaller if each
  /// block has a separate slope of the table, because each fit is then slow.
  [[nodiscard]] std::size_t max_candidate_fits() const {
    constexpr Eigen::Index many_directions = 24;
    return plain_.fit->shared() > many_directions ? 8 : 48;
  }

  /// @param set       the readings of the run; must outlive this object.
  /// @param estimate  their fit; must outlive this object.
  SuspectRun(const ReadingSet& set, const Estimate& estimate, bool known_field);

  [[nodiscard]] const ReadingSet& set() const { return set_; }
  [[nodiscard]] const Estimate& estimate() const { return estimate_; }
  [[nodiscard]] const HypothesisFitter& fitter() const { return fitter_; }
  [[nodiscard]] Eigen::Index n() const { return set_.size(); }
  [[nodiscard]] Eigen::Index m() const { return set_.axis_count(); }
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(set_.size()); }
  [[nodiscard]] int run_of(std::size_t i) const { return set_.readings[i].run; }

  /// Indices of the readings, in the order in which the readings were taken.
  [[nodiscard]] const std::vector<std::size_t>& order() const { return order_; }

  /// True if the ratio of the axes' noise was stated.
  [[nodiscard]] bool stated_ratio() const { return stated_ratio_; }

  /// The fit of all readings.
  [[nodiscard]] const HypothesisFit& plain() const { return plain_; }

  /// The fit without reading i. `fitted` is false if this deletion was not fitted, because it
  /// reduces the sum of squares too little.
  [[nodiscard]] const HypothesisFit& without(std::size_t i) const { return deletions_[i]; }

  /// Indices of the readings, sorted by how much the deletion of the reading reduces the sum of
  /// squares, the largest reduction first.
  [[nodiscard]] const std::vector<std::size_t>& ranked_by_deletion() const { return by_deletion_; }

  /// The best fit without two readings, and the indices of these two readings.
  [[nodiscard]] const HypothesisFit& best_pair() const { return best_pair_; }
  [[nodiscard]] const ReadingPair& pair() const { return pair_; }

  void fit_single_deletions();

  /// Finds the best pair of readings to leave out. Candidates are the readings whose deletion
  /// reduces the sum of squares most, and the readings with the largest residuals.
  void fit_pair_deletions();

  /// @return at most 12 pairs of the candidates: those without which the sum of squares would be
  ///         smallest, to first order. A mistake in both readings of a pair is sought only in
  ///         these.
  [[nodiscard]] std::vector<ReadingPair> pairs_to_fit(
      const std::vector<std::size_t>& candidates) const;

  /// Sets the scale of each axis to its scatter in `clean`, and repeats all fits.
  /// @param clean  a fit without the worst readings.
  void weigh_axes_by(const HypothesisFit& clean);

  /// The full response of axis k [unit]: the norm of its sensitivities times the field's magnitude.
  [[nodiscard]] double full_response(Eigen::Index k) const {
    return plain_.coefficients.col(k).segment<3>(1).norm() * plain_.field.magnitude();
  }

  /// The smallest number of readings with which each reading can be tested against the others.
  static constexpr Eigen::Index fewest_for_deletion = 24;
  [[nodiscard]] bool has_independent_readings() const { return n() >= fewest_for_deletion; }

  /// True if the residuals are not larger than rounding errors.
  [[nodiscard]] bool only_rounding() const;

  [[nodiscard]] std::vector<std::size_t> largest_residuals(std::size_t most) const;

  /// Returns the reduction of the sum of squares, to first order, if these readings are left out.
  /// rss_drop_with_columns() returns the reduction if these columns are added to the fit.
  [[nodiscard]] double rss_drop_without_readings(const HypothesisFit& fit,
                                                 std::span<const std::size_t> readings) const;
  [[nodiscard]] double rss_drop_with_columns(const HypothesisFit& fit,
                                             Eigen::MatrixXd columns) const;

  /// Returns the reduction of the sum of squares, to first order, by a common shift of some
  /// readings of one axis.
  [[nodiscard]] double rss_drop_with_shift(const HypothesisFit& fit,
                                           Eigen::Index axis,
                                           const std::vector<std::size_t>& readings) const;

  /// Returns the fit in which the values of these readings are arbitrary: each axis of each reading
  /// has a free parameter. If `axis` is given, only this axis of the first reading has one.
  [[nodiscard]] HypothesisFit arbitrary(const std::vector<std::size_t>& readings,
                                        std::optional<Eigen::Index> axis = {}) const;

 private:
  [[nodiscard]] std::vector<Eigen::Index> rows_of(const std::vector<std::size_t>& readings) const;

  const ReadingSet& set_;
  const Estimate& estimate_;
  HypothesisFitter fitter_;
  bool stated_ratio_;
  std::vector<std::size_t> order_;
  HypothesisFit plain_;
  std::vector<HypothesisFit> deletions_;
  std::vector<std::size_t> by_deletion_;
  HypothesisFit best_pair_;
  ReadingPair pair_{};
};

/// Returns c^T M^-1 c, by a Cholesky factorisation without pivoting. Returns 0 if a pivot is not
/// above `open_below`. The loops do not call Eigen, so that the compiler can unroll them if M has
/// few rows.
/// @param M  symmetric; only the lower triangle is read.
template <typename Square, typename Vector>
[[nodiscard]] double squares_by(Square M, Vector c, double open_below) {
  double squares = 0.0;
  for (Eigen::Index j = 0; j < M.rows(); ++j) {
    double pivot = M(j, j);
    double left = c(j);
    for (Eigen::Index l = 0; l < j; ++l) {
      pivot -= M(j, l) * M(j, l);
      left -= M(j, l) * c(l);
    }
    if (!(pivot > open_below)) {
      return 0.0;
    }
    const double root = std::sqrt(pivot);
    c(j) = left / root;
    squares += c(j) * c(j);
    for (Eigen::Index i = j + 1; i < M.rows(); ++i) {
      double sum = M(i, j);
      for (Eigen::Index l = 0; l < j; ++l) {
        sum -= M(i, l) * M(j, l);
      }
      M(i, j) = sum / root;
    }
  }
  return squares;
}

/// @return the first `count` elements of `order`, or all if it has fewer.
[[nodiscard]] std::vector<std::size_t> first_of(const std::vector<std::size_t>& order,
                                                std::size_t count);

}  // namespace axiscal
