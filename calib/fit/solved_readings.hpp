// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include "calib/fit/model.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The readings of a fit with their solution, for the diagnostics of that fit.
class SolvedReadings {
 public:
  /// @param set               the readings; must outlive this object.
  /// @param directions_known  true if the field's directions are given, false if they are fitted.
  /// @param solution          solution of the fit. If it is null, the solution is computed when it
  ///                          is needed.
  SolvedReadings(const ReadingSet& set,
                 bool directions_known,
                 std::shared_ptr<const Solution> solution = nullptr)
      : set_(set), directions_known_(directions_known), solution_(std::move(solution)) {}

  [[nodiscard]] const ReadingSet& set() const { return set_; }
  [[nodiscard]] bool known_field() const { return directions_known_; }

  /// @return the solution of the model with its fields held at `field`.
  [[nodiscard]] std::shared_ptr<const Solution> at(const TableField& field) const;

 private:
  const ReadingSet& set_;
  bool directions_known_;
  std::shared_ptr<const Solution> solution_;
};

}  // namespace axiscal
