// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/stuck_watch.hpp"

#include "acquisition/src/dwell_sums.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

constexpr double stuck_s = 0.8;

}  // namespace

void StuckWatch::learn(const Eigen::VectorXd& sd) {
  scattered_ = scattered_.size() == 0 ? (sd.array() > 0.0).eval()
                                      : (scattered_ || (sd.array() > 0.0)).eval();
}

void StuckWatch::look() {
  stuck_.clear();
  const Eigen::VectorXd& floor = stillness_.floor();
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const Stillness::Unchanged same = stillness_.unchanged(k);
    // If the noise is below the step of the A/D converter, a constant value is not a fault.
    if (scattered_.size() > 0 && scattered_[axis] && floor(axis) > stillness_.step()(axis) &&
        same.seconds >= stuck_s && same.samples >= fewest_samples_of_dwell) {
      stuck_.push_back(axes_[k]);
    }
  }
}

std::string StuckWatch::text() const {
  return stuck_.empty() ? ""
                        : joined(stuck_) +
                              ": the value has not changed for a while; is the sensor or its "
                              "converter stuck?";
}

}  // namespace axiscal
