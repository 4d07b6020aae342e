// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/acquisition/stillness.hpp"

namespace axiscal {

/// Detects axes whose value does not change at all.
class StuckWatch {
 public:
  /// @param axes, stillness  must outlive this object.
  StuckWatch(const std::vector<std::string>& axes, const Stillness& stillness)
      : axes_(axes), stillness_(stillness) {}

  /// Records which axes scatter. Only an axis that has scattered can later be reported as stuck.
  /// @param sd  standard deviations of a reading, m entries.
  void learn(const Eigen::VectorXd& sd);

  /// Updates the list of stuck axes. Must be called after each sample.
  void look();

  [[nodiscard]] bool is_stuck() const { return !stuck_.empty(); }

  /// @return a message about the stuck axis; empty without a problem.
  [[nodiscard]] std::string text() const;

 private:
  const std::vector<std::string>& axes_;
  const Stillness& stillness_;
  Eigen::Array<bool, Eigen::Dynamic, 1> scattered_;  // true if an axis scattered; set by learn()
  std::vector<std::string> stuck_;
};

}  // namespace axiscal
