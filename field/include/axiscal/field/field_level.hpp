// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The factor that multiplies the induced field during a reading: one number for all induced parts,
/// or different numbers for named parts.
class AXISCAL_EXPORT FieldLevel {
 public:
  /// The level of each named part; the key is the part's name.
  using OfParts = std::map<std::string, double, std::less<>>;

  /// Makes one level for all induced parts. The constructor is not explicit, because most fields
  /// have only one level.
  FieldLevel(double of_all = 1.0) : of_all_(of_all) {}  // NOLINT(google-explicit-constructor)

  /// @param of_parts   level of each named part.
  /// @param of_others  level of the induced parts that are not in `of_parts`.
  explicit FieldLevel(OfParts of_parts, double of_others = 1.0);

  /// @return the level of the part with the name `part`.
  [[nodiscard]] double of(std::string_view part) const {
    return of_parts_ ? own_level(part) : of_all_;
  }

  /// @return the level of the parts that are not in of_parts().
  [[nodiscard]] double of_all() const { return of_all_; }

  [[nodiscard]] bool has_level_per_part() const { return of_parts_ != nullptr; }

  /// @return the levels of the named parts; empty if all parts have the same level.
  [[nodiscard]] const OfParts& of_parts() const;

  /// @return the level as text: "1", "-0.5", "north -1, up 0".
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
