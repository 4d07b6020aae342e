// SPDX-License-Identifier: Apache-2.0
#include "calib/mistakes/src/hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "calib/regression/common_noise.hpp"

namespace axiscal {

double dof_reduction_factor_without(const HypothesisFit& fit,
                                    std::span<const std::size_t> readings) {
  Eigen::MatrixXd residuals = fit.residuals;
  for (const std::size_t i : readings) {
    residuals.row(static_cast<Eigen::Index>(i)).setZero();
  }
  return dof_reduction_factor(residuals, fit.degrees_of_freedom.mean());
}

double between_groups_p(const HypothesisFit& fit,
                        const Eigen::VectorXd& scale,
                        const MeanReadings& means) {
  constexpr double fewest_within = 6.0;
  const Eigen::VectorXd& free_within = means.degrees_of_freedom;
  if (!fit.fitted || free_within.minCoeff() < fewest_within ||
      fit.degrees_of_freedom.minCoeff() < 1.0) {
    return 1.0;
  }
  FisherSum axes;
  for (Eigen::Index k = 0; k < scale.size(); ++k) {
    const double between = fit.rss(k) * scale(k) * scale(k) / fit.degrees_of_freedom(k);
    const double within = means.squares(k) / free_within(k);
    axes.add(f_upper_p(between / within, fit.degrees_of_freedom(k), free_within(k)));
  }
  return axes.p_value();
}

HypothesisFitter HypothesisFitter::by_scatter_of(const HypothesisFit& fit) const {
  const Eigen::VectorXd own =
      scale_.array() * (fit.rss.array() / fit.degrees_of_freedom.array().max(0.5)).sqrt();
  return {fit.field, known_field_, own};
}

HypothesisFit HypothesisFitter::fit(const ReadingSet& given,
                                    const std::vector<std::size_t>& without,
                                    const AddedColumns& added) const {
  Eigen::MatrixXd weights = given.weights;
  for (const std::size_t i : without) {
    weights.row(static_cast<Eigen::Index>(i)).setZero();
  }
  const Model plain(given, known_field_, weights);
  const Model model = added ? plain.with(added) : plain;
  return fit_from([&] { return model.at(model.start(field_)); }, model);
}

HypothesisFit HypothesisFitter::refit(const HypothesisFit& fit) const {
  return fit_from([&] { return fit.fit->solution(); }, Model(fit.fit->set(), known_field_));
}

HypothesisFit HypothesisFitter::fit_from(
    const std::function<std::shared_ptr<const Solution>()>& start, const Model& model) const {
  HypothesisFit result;
  result.field = field_;
  const ReadingSet& given = model.readings();
  std::shared_ptr<const Solution> solution;
  try {
    // The fit may not converge, for example if a reading has a large mistake. Its sum of squares is
    // then too large, so that a hypothesis whose fit did not converge has no advantage.
    solution = model.solved(start(), scale_, {.most_rounds = 50, .least_decrease = 1e-9}).state;
  } catch (const RankDeficientError&) {
    return result;
  }
  result.fit = std::make_shared<const Fit>(given, solution, scale_);
  const Fit& fit = *result.fit;
  if (!fit.is_determined()) {
    result.fit.reset();
    return result;
  }
  const Eigen::Index m = given.axis_count();
  const Eigen::Index q = solution->place.added.size();
  result.fitted = true;
  result.field = solution->field();
  result.coefficients = fit.unknowns().head(fit.first_shared()).reshaped(given.column_count(), m);
  result.residuals = fit.residuals().reshaped(m, given.size()).transpose();
  result.added = solution->place.added + fit.unknowns().tail(q);
  result.information = fit.covariance_of_shared().diagonal().tail(q).cwiseInverse();
  result.rss.resize(m);
  result.degrees_of_freedom.resize(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double least = std::pow(given.rounding(k) / scale_(k), 2);
    result.degrees_of_freedom(k) = fit.degrees_of_freedom_of(k);
    result.rss(k) = std::max(result.residuals.col(k).squaredNorm(),
                             least * std::max(result.degrees_of_freedom(k), 0.0));
  }
  result.loss = dof_reduction_factor(result.residuals, result.degrees_of_freedom.mean());
  return result;
}

}  // namespace axiscal
