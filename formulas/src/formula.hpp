// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace axiscal {

/// A mathematical expression of variables, with the usual precedence. It may be evaluated from
/// several threads.
///
/// Operators: + - * / ^, comparisons, && ||, a ? b : c. Constants: pi and _e. Functions: abs, acos,
/// acosh, asin, asinh, atan, atan2, atanh, avg, cbrt, cos, cosh, exp, hypot, ln (also log), log10,
/// log2, max, min, rint, sign, sin, sinh, sqrt, sum, tan, tanh.
class Formula {
 public:
  /// @param names  names of the variables that the formula may contain.
  /// @throws DomainError  if the text is not a formula of these variables; the message gives the
  ///                      position.
  Formula(const std::string& text, std::vector<std::string> names);

  /// @param values  values of the variables, in the order of `names`.
  /// @return the value; NaN if it is undefined.
  [[nodiscard]] double operator()(std::span<const double> values) const noexcept;

  /// @return true if the formula contains the variable `name`.
  [[nodiscard]] bool has(const std::string& name) const;

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  struct Parsed;
  std::string text_;
  std::shared_ptr<Parsed> parsed_;
};

}  // namespace axiscal
