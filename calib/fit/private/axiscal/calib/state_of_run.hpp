// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include "axiscal/calib/model.hpp"
#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// The solution of a run for the field that was asked for last. Several diagnostics of one fit
/// share it.
class StateOfRun {
 public:
  /// @param set          must outlive it, and stay as it is.
  /// @param known_field  whether the field's directions are given, not fitted.
  /// @param first        of the set, where a fit has left it; null else.
  StateOfRun(const ReadingSet& set,
             bool known_field,
             std::shared_ptr<const Solution> first = nullptr)
      : set_(set), known_field_(known_field), last_(std::move(first)) {}

  [[nodiscard]] const ReadingSet& set() const { return set_; }
  [[nodiscard]] bool known_field() const { return known_field_; }
  [[nodiscard]] std::shared_ptr<const Solution> at(const TableField& field);

  /// @return whether it is that of a field already, so that nothing need be fitted for it.
  [[nodiscard]] bool is_of(const TableField& field) const {
    return last_ && last_->field().vectors() == field.vectors();
  }

  /// Gives back its memory; whoever asks next has it made anew.
  void forget() { last_.reset(); }

 private:
  const ReadingSet& set_;
  bool known_field_;
  std::shared_ptr<const Solution> last_;
};

}  // namespace axiscal
