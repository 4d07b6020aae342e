// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "axiscal/acquisition/session.hpp"
#include "core/json_document.hpp"

namespace axiscal {

/// The points of a session and their readings. Only journal entries can change the list, so that
/// reading the journal again gives the same list.
class ReadingList {
 public:
  explicit ReadingList(const std::vector<RunSheetRow>& sheet);

  /// These functions return the journal entry for a change of the list.
  [[nodiscard]] static Json captured(const CapturedReading& reading);
  [[nodiscard]] static Json dropped(int run, const std::string& why);
  [[nodiscard]] static Json skipped(std::size_t step);
  [[nodiscard]] static Json replicate();
  [[nodiscard]] static Json finished();

  /// Applies a journal entry to the list. An entry of an unknown kind is ignored.
  /// @throws DataError  if the entry contradicts the list.
  void apply(const JsonValue& entry);
  void apply(const Json& entry);

  [[nodiscard]] const std::vector<SessionStep>& steps() const { return steps_; }
  [[nodiscard]] const std::vector<CapturedReading>& readings() const { return readings_; }

  /// @return the readings in the order taken, with the numbers of samples, the standard deviations,
  ///         the times and the temperatures.
  [[nodiscard]] Observations observations(Eigen::Index axis_count) const;

  /// @return the next step; nullopt if all steps are done or skipped.
  [[nodiscard]] std::optional<std::size_t> next() const;

  /// @return the first step for a point that is neither done nor skipped and has the same block and
  ///         field level as step `of_block`; nullopt if there is none.
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
