// SPDX-License-Identifier: Apache-2.0
#include "curvature.hpp"

#include "axiscal/calib/variance_components.hpp"

namespace axiscal {

double BendTest::readings_of(Eigen::Index axis) const {
  return static_cast<double>((layings_.set().weights.col(axis).array() > 0.0).count()) +
         layings_.degrees_of_freedom(axis);
}

bool BendTest::weigh_alike_if_equal(const Eigen::Ref<const Eigen::VectorXd>& left) {
  const ReadingSet& set = layings_.set();
  const Eigen::Index m = set.axis_count();
  const Eigen::VectorXd ratio = set.noise_ratio.size() > 0
                                    ? Eigen::VectorXd(set.noise_ratio.cwiseAbs2())
                                    : Eigen::VectorXd(Eigen::VectorXd::Ones(m));
  const Eigen::VectorXd squares = (layings_.squares + left).cwiseQuotient(ratio);
  // Of each axis's own columns, the square's among them, and its part of the directions.
  const double taken = static_cast<double>(set.column_count()) + 1.0 +
                       (directions_ ? 2.0 / static_cast<double>(m) : 0.0);
  Eigen::VectorXd free(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    free(k) = readings_of(k) - taken;
  }
  constexpr double contradicted = 0.1;
  const bool alike = set.noise_ratio.size() > 0 ||
                     equal_variances_p(squares.cwiseQuotient(free), free) > contradicted;
  if (!(free.minCoeff() > 1.0) || !alike) {
    return false;
  }
  variances_.head(m) = squares.sum() / free.sum() * ratio;
  return true;
}

}  // namespace axiscal
