// SPDX-License-Identifier: Apache-2.0
#include "calib/cube/src/record_prior.hpp"

#include <algorithm>
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

constexpr double dof_of_mean = 20.0;
constexpr double different_variance = 0.01;
constexpr double dof_of_exact = 1e9;

// Returns the variances of the axes, each divided by the squared full response |S_k| F, so that
// instruments with different units can be compared.
Eigen::ArrayXd relative_variances(const RecordErrors& record) {
  const Eigen::Index m = record.sensitivity.rows();
  Eigen::ArrayXd variances(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double size = record.sensitivity.row(k).squaredNorm();
    const Eigen::Vector4d own = record.covariance.diagonal().segment<4>(4 * k);
    variances(k) = (own(0) / (record.F * record.F) + own.tail<3>().sum()) / size;
  }
  return variances;
}

double dof_of(const RecordErrors& record) {
  return record.degrees_of_freedom > 0.0 ? record.degrees_of_freedom : dof_of_exact;
}

// The instruments whose records' variances do not differ significantly, and their mean variance.
struct Pool {
  std::vector<bool> comparable;
  double mean = 0.0;
  double degrees_of_freedom = 0.0;
};

Pool pool_of(const std::vector<RecordErrors>& records, const std::vector<double>& variances) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (variances[i] > 0.0) {
      order.push_back(i);
    }
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return variances[a] < variances[b]; });
  Pool pool{.comparable = std::vector<bool>(records.size(), false)};
  double sum = 0.0;
  double count = 0.0;
  for (const std::size_t i : order) {
    const double nu = dof_of(records[i]);
    if (count > 0.0 && !(f_upper_p(variances[i] / (sum / count), nu, pool.degrees_of_freedom) >
                         different_variance)) {
      break;
    }
    pool.comparable[i] = true;
    pool.degrees_of_freedom += nu;
    sum += variances[i];
    count += 1.0;
  }
  pool.mean = count > 0.0 ? sum / count : 0.0;
  return pool;
}

Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  const double largest = eigen.values.cwiseAbs().maxCoeff();
  if (!(largest > 0.0)) {
    return {covariance.rows(), 0};
  }
  const Eigen::Index rank = (eigen.values.array() > 1e-12 * largest).count();
  return eigen.vectors.rightCols(rank) * eigen.values.tail(rank).cwiseSqrt().asDiagonal();
}

}  // namespace

std::vector<RecordPrior> record_priors(const std::vector<RecordErrors>& records) {
  std::vector<double> variances;
  variances.reserve(records.size());
  for (const RecordErrors& record : records) {
    variances.push_back(relative_variances(record).mean());
  }
  const Pool pool = pool_of(records, variances);
  std::vector<RecordPrior> priors;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const RecordErrors& record = records[i];
    const Eigen::ArrayXd own = relative_variances(record);
    const double nu = dof_of(record) / static_cast<double>(own.size());
    const double mean = pool.comparable[i] ? pool.mean : variances[i];
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(record.covariance.rows());
    for (Eigen::Index k = 0; k < own.size(); ++k) {
      if (own(k) > 0.0) {
        const double drawn = (nu * own(k) + dof_of_mean * mean) / (nu + dof_of_mean);
        scale.segment<4>(4 * k).setConstant(std::sqrt(drawn / own(k)));
      }
    }
    const double dof = pool.comparable[i] ? pool.degrees_of_freedom : dof_of(record);
    priors.push_back({.root = root_of(scale.asDiagonal() * record.covariance * scale.asDiagonal()),
                      .degrees_of_freedom = dof < dof_of_exact ? dof : 0.0});
  }
  return priors;
}

}  // namespace axiscal
