// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/dwell_sums.hpp"

#include <algorithm>
#include <cmath>

namespace axiscal {

DwellSums::DwellSums(Eigen::Index axes) : mean_(axes), squares_(axes), products_(axes) {
  clear();
}

void DwellSums::clear() {
  count_ = 0.0;
  mean_time_ = 0.0;
  time_squares_ = 0.0;
  mean_.setZero();
  squares_.setZero();
  products_.setZero();
}

// Uses Welford's recurrences (Technometrics 4, 1962), also for the products of time and value.
void DwellSums::add(double time_s, const Eigen::VectorXd& values) {
  if (count_ == 0.0) {
    start_s_ = time_s;
  }
  end_s_ = time_s;
  count_ += 1.0;
  const double time = time_s - start_s_;
  const double time_before = time - mean_time_;
  mean_time_ += time_before / count_;
  time_squares_ += time_before * (time - mean_time_);
  const Eigen::VectorXd before = values - mean_;
  mean_ += before / count_;
  const Eigen::VectorXd after = values - mean_;
  squares_ += before.cwiseProduct(after);
  products_ += time_before * after;
}

Eigen::VectorXd DwellSums::sd() const {
  return (squares_ / std::max(count_ - 1.0, 1.0)).cwiseSqrt();
}

double DwellSums::drift() const {
  constexpr double fewest = 10.0;
  if (count_ < fewest || !(time_squares_ > 0.0)) {
    return 0.0;
  }
  double largest = 0.0;
  for (Eigen::Index k = 0; k < mean_.size(); ++k) {
    const double slope = products_(k) / time_squares_;
    const double left = std::max(squares_(k) - slope * products_(k), 0.0);
    const double sd = std::sqrt(left / (count_ - 2.0));
    const double change = std::abs(slope) * seconds();
    const double u = sd / std::sqrt(time_squares_) * seconds();
    if (change > sd && u > 0.0) {
      largest = std::max(largest, change / u);
    }
  }
  return largest;
}

}  // namespace axiscal
