// SPDX-License-Identifier: Apache-2.0
#include "matchers.hpp"

namespace axiscal::test {

testing::AssertionResult matrices_near(const Eigen::MatrixXd& actual,
                                       const Eigen::MatrixXd& expected,
                                       double tolerance) {
  if (actual.rows() != expected.rows() || actual.cols() != expected.cols()) {
    return testing::AssertionFailure() << actual.rows() << " x " << actual.cols() << ", expected "
                                       << expected.rows() << " x " << expected.cols();
  }
  const double difference = actual.size() == 0 ? 0.0 : (actual - expected).cwiseAbs().maxCoeff();
  if (actual.allFinite() && expected.allFinite() && difference <= tolerance) {
    return testing::AssertionSuccess();
  }
  return testing::AssertionFailure()
         << "largest difference " << difference << " exceeds " << tolerance << "\nactual:\n"
         << actual << "\nexpected:\n"
         << expected;
}

}  // namespace axiscal::test
