// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// An expression of named numbers, with the precedence of mathematics: + - * / ^, comparisons, &&
/// ||, a ? b : c; abs, acos, acosh, asin, asinh, atan, atan2, atanh, avg, cbrt, cos, cosh, exp,
/// hypot, ln (also log), log10, log2, max, min, rint, sign, sin, sinh, sqrt, sum, tan, tanh; pi and
/// _e. It may be evaluated from several threads.
class Formula {
 public:
  /// @param names  of the numbers that it may have.
  /// @throws DomainError  if the text is not a formula of these names; the message says where.
  Formula(const std::string& text, std::vector<std::string> names);

  /// @param values  of the names, in their order.
  /// @return the value; NaN if it is not defined there.
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
