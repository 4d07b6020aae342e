// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// An expression of named numbers: sin, cos, tan, asin, acos, atan, atan2, sqrt, exp, ln, abs,
/// hypot, min, max, pi, and what else muParser knows. It may be evaluated from several threads.
class Formula {
 public:
  /// @param names  of the numbers that it may have.
  /// @throws DomainError  if the text is no formula of these; the message says where.
  Formula(const std::string& text, std::vector<std::string> names);

  /// @param values  of the names, in their order.
  /// @return the value; NaN where it has none.
  [[nodiscard]] double operator()(std::span<const double> values) const noexcept;

  /// @return whether one of its numbers is this one.
  [[nodiscard]] bool has(const std::string& name) const;

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  struct Parsed;
  std::string text_;
  std::shared_ptr<Parsed> parsed_;
};

}  // namespace axiscal
