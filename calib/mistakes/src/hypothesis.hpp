// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/fit.hpp"
#include "calib/fit/layings.hpp"
#include "calib/fit/model.hpp"

namespace axiscal {

/// The fit of the readings under a hypothesis, and its sums of squares.
struct HypothesisFit {
  bool fitted = false;  ///< false if the readings do not determine the fit
  TableField field;
  Eigen::MatrixXd coefficients;        ///< p x m: the p coefficients of each axis
  Eigen::VectorXd rss;                 ///< m: sum of squares of each column of `residuals`
  Eigen::VectorXd degrees_of_freedom;  ///< m: degrees of freedom of each entry of `rss`
  double loss = 1.0;                   ///< dof_reduction_factor() of the residuals
  Eigen::VectorXd added;               ///< q: estimated coefficients of the added columns
  Eigen::VectorXd information;         ///< q: inverse variance of each entry of `added`
  Eigen::MatrixXd residuals;           ///< n x m: weighted residuals, divided by the axis's scale
  std::shared_ptr<const Fit> fit;      ///< null after forget_readings()

  /// Frees the members that have an entry for each reading.
  void forget_readings() {
    residuals.resize(0, 0);
    fit.reset();
  }

  [[nodiscard]] double total() const { return rss.sum(); }
  [[nodiscard]] double dof() const { return degrees_of_freedom.sum(); }
};

/// @return dof_reduction_factor() of the residuals of `fit`, with the residuals of `readings` set
///         to 0, because these readings may be wrong in several axes.
[[nodiscard]] double dof_reduction_factor_without(const HypothesisFit& fit,
                                                  std::span<const std::size_t> readings);

/// Compares the scatter of means about their fit with the scatter of the readings about the means.
/// @param fit    the fit of the means.
/// @param scale  m entries: HypothesisFitter::scale() of this fit.
/// @return the p-value of the ratio of the mean squares, with the axes combined by Fisher's method;
///         1 if an axis has fewer than six degrees of freedom within the groups or less than one
///         between them.
[[nodiscard]] double between_groups_p(const HypothesisFit& fit,
                                      const Eigen::VectorXd& scale,
                                      const MeanReadings& means);

/// Fits readings under hypotheses: without some readings, or with further columns.
class HypothesisFitter {
 public:
  /// @param field        the field. It is fixed if `known_field` is true; otherwise it is the start
  ///                     of the fit.
  /// @param known_field  true if the directions of the field are given.
  /// @param scale        m entries: the number by which the residuals of each axis are divided.
  HypothesisFitter(TableField field, bool known_field, Eigen::VectorXd scale)
      : field_(std::move(field)), known_field_(known_field), scale_(std::move(scale)) {}

  /// @param given    the readings under the hypothesis, for example with a changed pose. They must
  ///                 outlive HypothesisFit::fit of the result.
  /// @param without  indices of the readings to leave out.
  /// @param added    the columns that the hypothesis adds; may be empty.
  [[nodiscard]] HypothesisFit fit(const ReadingSet& given,
                                  const std::vector<std::size_t>& without = {},
                                  const AddedColumns& added = {}) const;

  /// @param fit  a fit of all readings, with other scales.
  /// @return the fit of the same readings with the scales of this fitter.
  [[nodiscard]] HypothesisFit refit(const HypothesisFit& fit) const;

  /// @return a fitter that starts from the field of `fit`, with the scatter of each axis in `fit`
  ///         as its scale.
  [[nodiscard]] HypothesisFitter by_scatter_of(const HypothesisFit& fit) const;

  [[nodiscard]] const Eigen::VectorXd& scale() const { return scale_; }
  [[nodiscard]] bool known_field() const { return known_field_; }
  void start_at(TableField field) { field_ = std::move(field); }

 private:
  // @param start  returns the solution from which the fit of `model` starts.
  [[nodiscard]] HypothesisFit fit_from(
      const std::function<std::shared_ptr<const Solution>()>& start, const Model& model) const;

  TableField field_;
  bool known_field_;
  Eigen::VectorXd scale_;
};

}  // namespace axiscal
