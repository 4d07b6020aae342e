// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/repeated_design.hpp"

#include "axiscal/calib/least_squares.hpp"

namespace axiscal {

RepeatedDesign repeated_design(const Eigen::Ref<const Eigen::MatrixXd>& design,
                               const std::vector<std::string>& names) {
  using RowByRow = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const LeastSquaresDesign factored(design, Eigen::VectorXd(), names);
  const RowByRow X = design;
  RowByRow P(X.cols(), X.rows());
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    P.col(i) = factored.estimate(Eigen::VectorXd::Unit(X.rows(), i));
  }
  return {.readings = static_cast<std::size_t>(X.rows()),
          .parameters = static_cast<std::size_t>(X.cols()),
          .design = {X.data(), X.data() + X.size()},
          .pseudo_inverse = {P.data(), P.data() + P.size()}};
}

}  // namespace axiscal
