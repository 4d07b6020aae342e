// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/sweep_legs.hpp"

#include <algorithm>
#include <limits>

namespace axiscal {

Eigen::VectorXd sweep_directions(const Eigen::VectorXd& temperatures) {
  constexpr double share_to_turn = 0.2;
  Eigen::VectorXd ways = Eigen::VectorXd::Zero(temperatures.size());
  if (temperatures.size() == 0) {
    return ways;
  }
  const double back = share_to_turn * (temperatures.maxCoeff() - temperatures.minCoeff());
  double way = 0.0;  // direction of the present leg: 1 is up, -1 is down, 0 is not known yet
  Eigen::Index first = 0;
  Eigen::Index highest = 0;
  Eigen::Index lowest = 0;
  // Sets the direction of the leg that ends at an extreme. The next leg begins at this extreme.
  const auto close = [&](Eigen::Index end, double leg) {
    ways.segment(first, end - first).setConstant(leg);
    first = end;
  };
  for (Eigen::Index i = 1; i < temperatures.size(); ++i) {
    const double t = temperatures(i);
    highest = t > temperatures(highest) ? i : highest;
    lowest = t < temperatures(lowest) ? i : lowest;
    if (way >= 0.0 && t < temperatures(highest) - back) {
      close(highest, 1.0);
      way = -1.0;
      lowest = i;
    } else if (way <= 0.0 && t > temperatures(lowest) + back) {
      close(lowest, -1.0);
      way = 1.0;
      highest = i;
    }
  }
  close(temperatures.size(), way);
  return ways;
}

bool is_bidirectional(const Eigen::VectorXd& temperatures, const Eigen::VectorXd& ways) {
  const double range = temperatures.maxCoeff() - temperatures.minCoeff();
  const auto spans_half = [&](double way) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (Eigen::Index i = 0; i < ways.size(); ++i) {
      if (ways(i) == way) {
        low = std::min(low, temperatures(i));
        high = std::max(high, temperatures(i));
      }
    }
    return high - low >= 0.5 * range;
  };
  return range > 0.0 && spans_half(1.0) && spans_half(-1.0);
}

}  // namespace axiscal
