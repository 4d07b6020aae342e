// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/acquisition/stillness.hpp"

namespace axiscal {

/// Watches for axes that stay at one value to the last digit.
class StuckWatch {
 public:
  /// @param axes, stillness  must outlive it.
  StuckWatch(const std::vector<std::string>& axes, const Stillness& stillness)
      : axes_(axes), stillness_(stillness) {}

  /// An axis whose readings scatter is stuck when they stop to.
  /// @param sd  of a reading, m entries.
  void learn(const Eigen::VectorXd& sd);

  /// Looks again, after a sample.
  void look();

  [[nodiscard]] bool is_stuck() const { return !stuck_.empty(); }

  /// @return a message about the stuck axis; empty without a problem.
  [[nodiscard]] std::string text() const;

 private:
  const std::vector<std::string>& axes_;
  const Stillness& stillness_;
  Eigen::Array<bool, Eigen::Dynamic, 1> scattered_;  // axes whose readings did; empty before one
  std::vector<std::string> stuck_;
};

}  // namespace axiscal
