// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <mutex>
#include <string>

#include "axiscal/calib/study.hpp"

namespace axiscal {

/// @return the zero-based indices of a shard's blocks. Shard I of N runs every N-th block, starting
///         with the I-th.
[[nodiscard]] inline std::vector<std::int64_t> blocks_of_shard(const Study& study,
                                                               const Shard& shard) {
  std::vector<std::int64_t> blocks;
  for (std::int64_t block = shard.number - 1; block < block_count(study); block += shard.count) {
    blocks.push_back(block);
  }
  return blocks;
}

/// Adds the count of each name to `sum`.
inline void add_counts(const std::map<std::string, std::int64_t>& counts,
                       std::map<std::string, std::int64_t>& sum) {
  for (const auto& [name, count] : counts) {
    sum[name] += count;
  }
}

/// Reports the number of finished trials of all threads.
class ProgressReport {
 public:
  explicit ProgressReport(const std::function<void(std::int64_t)>& progress)
      : progress_(progress) {}

  void add(std::int64_t trials) {
    const std::scoped_lock lock(mutex_);
    done_ += trials;
    if (progress_) {
      progress_(done_);
    }
  }

 private:
  const std::function<void(std::int64_t)>& progress_;
  std::mutex mutex_;
  std::int64_t done_ = 0;
};

/// Runs a study with StudySetup::regression_only. Sets the parameters, block, blocks and sums of
/// `study`.
/// @param study  receives the results; its seed, trials and setup must be set.
void run_regression_study(const StudySetup& setup,
                          const Shard& shard,
                          const std::function<void(std::int64_t)>& progress,
                          Study& study);

}  // namespace axiscal
