// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The multiple of the induced field that was set for a reading: one number for all induced parts,
/// or for some parts, by their names, numbers of their own.
class AXISCAL_EXPORT FieldLevel {
 public:
  /// Levels of parts, by the parts' names.
  using OfParts = std::map<std::string, double, std::less<>>;

  /// One level for all induced parts. Not explicit, as most fields have one.
  FieldLevel(double of_all = 1.0) : of_all_(of_all) {}  // NOLINT(google-explicit-constructor)

  /// @param of_parts   one level or more.
  /// @param of_others  the level of the induced parts that are not among `of_parts`.
  explicit FieldLevel(OfParts of_parts, double of_others = 1.0);

  /// @return the level of a part of that name.
  [[nodiscard]] double of(std::string_view part) const {
    return of_parts_ ? own_level(part) : of_all_;
  }

  /// @return the level of the parts that have none of their own.
  [[nodiscard]] double of_all() const { return of_all_; }

  [[nodiscard]] bool has_level_per_part() const { return of_parts_ != nullptr; }

  /// @return the levels of the parts that have their own; none where it does not differ by part.
  [[nodiscard]] const OfParts& of_parts() const;

  /// @return as text, "1", "-0.5", "north -1, up 0".
  [[nodiscard]] std::string text() const;

  friend bool operator==(const FieldLevel& a, const FieldLevel& b) { return compare(a, b) == 0; }
  friend bool operator<(const FieldLevel& a, const FieldLevel& b) { return compare(a, b) < 0; }

 private:
  [[nodiscard]] double own_level(std::string_view part) const;
  [[nodiscard]] static int compare(const FieldLevel& a, const FieldLevel& b);

  double of_all_ = 1.0;
  std::shared_ptr<const OfParts> of_parts_;
};

}  // namespace axiscal
