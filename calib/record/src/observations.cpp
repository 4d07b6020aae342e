// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/observations.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

int numbered_on(std::int64_t number) {
  if (number > std::numeric_limits<int>::max()) {
    throw DomainError("the numbers of runs or blocks are too large to continue in the next file");
  }
  return static_cast<int>(number);
}

}  // namespace

Observations concatenate(std::vector<Observations> parts) {
  if (parts.empty()) {
    throw DomainError("concatenate: no observations");
  }
  Observations all = std::move(parts.front());
  for (std::size_t k = 1; k < parts.size(); ++k) {
    const Observations& part = parts[k];
    if (part.response.cols() != all.response.cols()) {
      throw DomainError("concatenate: the numbers of axes differ");
    }
    if (all.samples.has_value() != part.samples.has_value()) {
      throw DomainError("some files have a column 'samples', but others lack it");
    }
    std::int64_t last_run = 0;
    std::int64_t last_block = 0;
    std::int64_t first_block = 1;
    for (const Reading& reading : all.readings) {
      last_run = std::max<std::int64_t>(last_run, reading.run);
      last_block = std::max<std::int64_t>(last_block, reading.block);
    }
    for (const Reading& reading : part.readings) {
      first_block = std::min<std::int64_t>(first_block, reading.block);
    }
    for (Reading reading : part.readings) {
      reading.run = numbered_on(reading.run + last_run);
      reading.block = numbered_on(reading.block + last_block + 1 - first_block);
      all.readings.push_back(reading);
    }
    const auto append = [](const auto& above, const auto& below) {
      Eigen::MatrixXd both(above.rows() + below.rows(), above.cols());
      both << above, below;
      return both;
    };
    all.response = append(all.response, part.response);
    if (all.samples) {
      all.samples = append(*all.samples, *part.samples).col(0);
    }
    if (all.response_sd && part.response_sd) {
      all.response_sd = append(*all.response_sd, *part.response_sd);
    } else {
      all.response_sd.reset();
    }
    if (all.saturated.has_value() != part.saturated.has_value()) {
      throw DomainError("concatenate: only some parts state which readings are saturated");
    }
    if (all.saturated && part.saturated) {
      Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> both(
          all.saturated->rows() + part.saturated->rows(), all.saturated->cols());
      both << *all.saturated, *part.saturated;
      all.saturated = std::move(both);
    }
    all.has_block = true;
    all.has_level = all.has_level || part.has_level;
    all.has_fence = all.has_fence && part.has_fence;
  }
  return all;
}

Observations select_rows(const Observations& observations, const std::vector<std::size_t>& rows) {
  Observations some;
  some.has_block = observations.has_block;
  some.has_level = observations.has_level;
  some.has_fence = observations.has_fence;
  some.readings.reserve(rows.size());
  for (const std::size_t row : rows) {
    some.readings.push_back(observations.readings[row]);
  }
  some.response = observations.response(rows, Eigen::seqN(0, observations.response.cols()));
  if (observations.samples) {
    some.samples = (*observations.samples)(rows);
  }
  if (observations.response_sd) {
    some.response_sd =
        (*observations.response_sd)(rows, Eigen::seqN(0, observations.response_sd->cols()));
  }
  if (observations.saturated) {
    some.saturated =
        (*observations.saturated)(rows, Eigen::seqN(0, observations.saturated->cols()));
  }
  return some;
}

}  // namespace axiscal
