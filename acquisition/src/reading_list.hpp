// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "core/json_document.hpp"

namespace axiscal {

/// The points of a session and their readings. Every change is an entry of the journal, and only
/// these entries change the list. So reading the journal gives the same list.
class ReadingList {
 public:
  explicit ReadingList(const std::vector<RunSheetRow>& sheet);

  /// The entries.
  [[nodiscard]] static Json captured(const CapturedReading& reading);
  [[nodiscard]] static Json dropped(int run, const std::string& why);
  [[nodiscard]] static Json skipped(std::size_t step);
  [[nodiscard]] static Json replicate();
  [[nodiscard]] static Json finished();

  /// Makes the change that an entry says; one of another kind changes nothing.
  /// @throws DataError  where it does not fit what there is.
  void apply(const JsonValue& entry);
  void apply(const Json& entry);

  [[nodiscard]] const std::vector<SessionStep>& steps() const { return steps_; }
  [[nodiscard]] const std::vector<CapturedReading>& readings() const { return readings_; }

  /// @return the readings, in the order taken; with samples, AXIS_sd, times, temperatures.
  [[nodiscard]] Observations observations(Eigen::Index axis_count) const;

  /// @return the next step; nullopt if all steps are done or skipped.
  [[nodiscard]] std::optional<std::size_t> next() const;

  /// @return the step that waits for a point in the block of another step.
  [[nodiscard]] std::optional<std::size_t> waiting_for(const DesignPoint& point,
                                                       std::size_t of_block) const;

  [[nodiscard]] const CapturedReading* find(int run) const;
  [[nodiscard]] int next_run() const { return last_run_ + 1; }
  [[nodiscard]] std::size_t left() const;
  [[nodiscard]] bool is_finished() const { return finished_; }

 private:
  std::vector<SessionStep> steps_;
  std::size_t replicate_size_;
  std::vector<CapturedReading> readings_;
  int last_run_ = 0;
  bool finished_ = false;
};

}  // namespace axiscal
