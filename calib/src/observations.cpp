// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/observations.hpp"

#include <algorithm>

#include "axiscal/core/error.hpp"

namespace axiscal {

Observations concatenate(const std::vector<Observations>& parts) {
  if (parts.empty()) {
    throw DomainError("concatenate: no observations");
  }
  Observations all = parts.front();
  for (std::size_t k = 1; k < parts.size(); ++k) {
    const Observations& part = parts[k];
    if (part.response.cols() != all.response.cols()) {
      throw DomainError("concatenate: the numbers of axes differ");
    }
    int last_run = 0;
    int last_block = 0;
    int first_block = 1;
    for (const Reading& reading : all.readings) {
      last_run = std::max(last_run, reading.run);
      last_block = std::max(last_block, reading.block);
    }
    for (const Reading& reading : part.readings) {
      first_block = std::min(first_block, reading.block);
    }
    for (Reading reading : part.readings) {
      reading.run += last_run;
      reading.block += last_block + 1 - first_block;
      all.readings.push_back(reading);
    }
    const auto append = [](const auto& above, const auto& below) {
      Eigen::MatrixXd both(above.rows() + below.rows(), above.cols());
      both << above, below;
      return both;
    };
    all.response = append(all.response, part.response);
    if (all.samples && part.samples) {
      all.samples = append(*all.samples, *part.samples).col(0);
    } else {
      all.samples.reset();
    }
    if (all.response_sd && part.response_sd) {
      all.response_sd = append(*all.response_sd, *part.response_sd);
    } else {
      all.response_sd.reset();
    }
    all.has_block = true;
    all.has_level = all.has_level || part.has_level;
  }
  return all;
}

}  // namespace axiscal
