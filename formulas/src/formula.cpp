// SPDX-License-Identifier: Apache-2.0
#include "formula.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <utility>

#ifdef AXISCAL_MUPARSER
#include <muParser.h>
#endif

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

#ifdef AXISCAL_MUPARSER

// muParser evaluates by the numbers at the addresses that it was given, one thread at a time.
struct Formula::Parsed {
  std::vector<double> values;
  std::vector<std::string> used;
  mu::Parser parser;
  std::mutex one_at_a_time;
};

namespace {

double hypotenuse(double a, double b) {
  return std::hypot(a, b);
}

}  // namespace

Formula::Formula(const std::string& text, std::vector<std::string> names)
    : text_(text), parsed_(std::make_shared<Parsed>()) {
  parsed_->values.resize(names.size());
  try {
    parsed_->parser.DefineFun("hypot", hypotenuse);
    parsed_->parser.DefineConst("pi", std::numbers::pi);
    for (std::size_t i = 0; i < names.size(); ++i) {
      parsed_->parser.DefineVar(names[i], &parsed_->values[i]);
    }
    parsed_->parser.SetExpr(text);
    for (const auto& [name, address] : parsed_->parser.GetUsedVar()) {
      parsed_->used.push_back(name);
    }
    static_cast<void>(parsed_->parser.Eval());
  } catch (const mu::Parser::exception_type& error) {
    throw DomainError(formatted("the formula '{}': {}", text, error.GetMsg()));
  }
}

double Formula::operator()(std::span<const double> values) const noexcept {
  const std::scoped_lock lock(parsed_->one_at_a_time);
  std::copy(values.begin(), values.end(), parsed_->values.begin());
  try {
    return parsed_->parser.Eval();
  } catch (const mu::Parser::exception_type&) {
    return not_a_number;
  }
}

bool Formula::has(const std::string& name) const {
  return std::find(parsed_->used.begin(), parsed_->used.end(), name) != parsed_->used.end();
}

#else

struct Formula::Parsed {};

Formula::Formula(const std::string& text, std::vector<std::string>) : text_(text) {
  throw DomainError("formulas need libmuparser, which this build is without");
}

double Formula::operator()(std::span<const double>) const noexcept {
  return not_a_number;
}

bool Formula::has(const std::string&) const {
  return false;
}

#endif

}  // namespace axiscal
