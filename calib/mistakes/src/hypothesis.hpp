// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/fit.hpp"
#include "calib/fit/model.hpp"

namespace axiscal {

/// The fit of a hypothesis about the readings, with the sums that it is judged by.
struct HypothesisFit {
  bool fitted = false;  ///< false: the readings do not determine it
  TableField field;
  Eigen::MatrixXd coefficients;        ///< p x m
  Eigen::VectorXd rss;                 ///< m: sums of squares, each axis in its scale
  Eigen::VectorXd degrees_of_freedom;  ///< m
  double loss = 1.0;                   ///< dof_reduction_factor()
  Eigen::VectorXd added;               ///< q: estimates of the added columns
  Eigen::VectorXd information;         ///< q: information on each of these estimates, at unit noise
  Eigen::MatrixXd residuals;           ///< n x m, weighted, in the axes' scale
  std::shared_ptr<const Fit> fit;      ///< null after forget_readings()

  /// Frees everything that is kept for each reading.
  void forget_readings() {
    residuals.resize(0, 0);
    fit.reset();
  }

  [[nodiscard]] double total() const { return rss.sum(); }
  [[nodiscard]] double dof() const { return degrees_of_freedom.sum(); }
};

/// @return dof_reduction_factor() of a fit without some readings, which may be wrong in several
/// axes.
[[nodiscard]] double dof_reduction_factor_without(const HypothesisFit& fit,
                                                  std::span<const std::size_t> readings);

/// Fits readings under hypotheses: without some readings, or with further columns.
class HypothesisFitter {
 public:
  /// @param field        to start from, or as given.
  /// @param known_field  whether the directions are given.
  /// @param scale        m: the unit of each axis's residuals.
  HypothesisFitter(TableField field, bool known_field, Eigen::VectorXd scale)
      : field_(std::move(field)), known_field_(known_field), scale_(std::move(scale)) {}

  /// @param given    the readings under the hypothesis; must outlive the result's `fit`.
  /// @param without  positions of readings to leave out.
  /// @param added    further columns; empty: none.
  [[nodiscard]] HypothesisFit fit(const ReadingSet& given,
                                  const std::vector<std::size_t>& without = {},
                                  const AddedColumns& added = {}) const;

  /// @return a fitter that starts from a fit, with each axis in the scale of its own scatter.
  [[nodiscard]] HypothesisFitter by_scatter_of(const HypothesisFit& fit) const;

  [[nodiscard]] const Eigen::VectorXd& scale() const { return scale_; }
  [[nodiscard]] bool known_field() const { return known_field_; }
  void start_at(TableField field) { field_ = std::move(field); }

 private:
  TableField field_;
  bool known_field_;
  Eigen::VectorXd scale_;
};

}  // namespace axiscal
