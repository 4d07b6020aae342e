// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/correction.hpp"

namespace axiscal {

Observations corrected(Observations observations, const Correction& correction) {
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    Reading& reading = observations.readings[i];
    for (const auto& [run, point] : correction.points) {
      if (run == reading.run) {
        reading.point = point;
      }
    }
    for (const auto& [run, level] : correction.levels) {
      if (run == reading.run) {
        reading.level = level;
      }
    }
    for (const auto& [run, response] : correction.responses) {
      if (run == reading.run) {
        observations.response.row(static_cast<Eigen::Index>(i)) = response;
      }
    }
  }
  return observations;
}

}  // namespace axiscal
