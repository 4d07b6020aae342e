// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/scaled_cholesky.hpp"

namespace axiscal {

template class ScaledCholeskyOf<Eigen::MatrixXd>;

}  // namespace axiscal
