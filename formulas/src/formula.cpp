// SPDX-License-Identifier: Apache-2.0
#include "formulas/src/formula.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <string_view>

#include <boost/spirit/home/x3.hpp>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

namespace x3 = boost::spirit::x3;

using Arguments = std::span<const double>;
using Apply = double (*)(Arguments);

// A step of a formula in postfix order. It takes its arguments from a stack and puts its result
// there.
struct Step {
  enum Kind { constant, variable, operation };
  Kind kind = constant;
  double value = 0.0;           // the value of a constant
  std::size_t variable_at = 0;  // the index of a variable in the formula's names
  Apply apply = nullptr;        // the function of an operation
  std::size_t arguments = 0;
};

struct Function {
  std::string_view name;
  std::size_t arguments;  // number of arguments; any_number if one or more are allowed
  Apply apply;
};

constexpr std::size_t any_number = 0;

constexpr std::array functions = {
    Function{"abs", 1, [](Arguments a) { return std::abs(a[0]); }},
    Function{"acos", 1, [](Arguments a) { return std::acos(a[0]); }},
    Function{"acosh", 1, [](Arguments a) { return std::acosh(a[0]); }},
    Function{"asin", 1, [](Arguments a) { return std::asin(a[0]); }},
    Function{"asinh", 1, [](Arguments a) { return std::asinh(a[0]); }},
    Function{"atan", 1, [](Arguments a) { return std::atan(a[0]); }},
    Function{"atan2", 2, [](Arguments a) { return std::atan2(a[0], a[1]); }},
    Function{"atanh", 1, [](Arguments a) { return std::atanh(a[0]); }},
    Function{"avg", any_number,
             [](Arguments a) {
               return std::accumulate(a.begin(), a.end(), 0.0) / static_cast<double>(a.size());
             }},
    Function{"cbrt", 1, [](Arguments a) { return std::cbrt(a[0]); }},
    Function{"cos", 1, [](Arguments a) { return std::cos(a[0]); }},
    Function{"cosh", 1, [](Arguments a) { return std::cosh(a[0]); }},
    Function{"exp", 1, [](Arguments a) { return std::exp(a[0]); }},
    Function{"hypot", 2, [](Arguments a) { return std::hypot(a[0], a[1]); }},
    Function{"ln", 1, [](Arguments a) { return std::log(a[0]); }},
    Function{"log", 1, [](Arguments a) { return std::log(a[0]); }},
    Function{"log10", 1, [](Arguments a) { return std::log10(a[0]); }},
    Function{"log2", 1, [](Arguments a) { return std::log2(a[0]); }},
    Function{"max", any_number, [](Arguments a) { return *std::max_element(a.begin(), a.end()); }},
    Function{"min", any_number, [](Arguments a) { return *std::min_element(a.begin(), a.end()); }},
    Function{"rint", 1, [](Arguments a) { return std::rint(a[0]); }},
    Function{"sign", 1,
             [](Arguments a) { return a[0] < 0.0 ? -1.0 : static_cast<double>(a[0] > 0.0); }},
    Function{"sin", 1, [](Arguments a) { return std::sin(a[0]); }},
    Function{"sinh", 1, [](Arguments a) { return std::sinh(a[0]); }},
    Function{"sqrt", 1, [](Arguments a) { return std::sqrt(a[0]); }},
    Function{"sum", any_number,
             [](Arguments a) { return std::accumulate(a.begin(), a.end(), 0.0); }},
    Function{"tan", 1, [](Arguments a) { return std::tan(a[0]); }},
    Function{"tanh", 1, [](Arguments a) { return std::tanh(a[0]); }}};

// The state of the parser: the steps that were found so far, and the calls that are still open.
struct Parsing {
  const std::vector<std::string>& names;
  std::vector<Step> steps;
  std::string called;               // the last name that was read
  std::vector<std::string> calls;   // the functions whose arguments are being read
  std::vector<std::size_t> counts;  // the number of arguments of each of these functions

  void add(std::size_t arguments, Apply apply) {
    steps.push_back({.kind = Step::operation, .apply = apply, .arguments = arguments});
  }

  void add_constant(double value) { steps.push_back({.kind = Step::constant, .value = value}); }

  void add_named_number() {
    const auto at = std::find(names.begin(), names.end(), called);
    if (at != names.end()) {
      steps.push_back(
          {.kind = Step::variable, .variable_at = static_cast<std::size_t>(at - names.begin())});
    } else if (called == "pi" || called == "_pi") {
      add_constant(std::numbers::pi);
    } else if (called == "_e") {
      add_constant(std::numbers::e);
    } else {
      throw DomainError(formatted("'{}' is not a known variable; the variables are {}", called,
                                  joined(names, ", ")));
    }
  }

  void begin_call() {
    calls.push_back(called);
    counts.push_back(0);
  }

  void end_call() {
    const std::string name = calls.back();
    const std::size_t count = counts.back();
    calls.pop_back();
    counts.pop_back();
    const auto known = std::find_if(functions.begin(), functions.end(),
                                    [&](const Function& one) { return one.name == name; });
    if (known == functions.end()) {
      throw DomainError(formatted("'{}' is not a known function", name));
    }
    if (known->arguments == any_number ? count == 0 : count != known->arguments) {
      throw DomainError(formatted(
          "the function '{}' needs {} arguments, not {}", name,
          known->arguments == any_number ? "one or more" : std::to_string(known->arguments),
          count));
    }
    add(count, known->apply);
  }
};

struct parsing_tag;

// A semantic action that calls `action` with the Parsing object.
template <typename Do>
auto then(Do&& action) {
  return [action](const auto& context) { action(x3::get<parsing_tag>(context).get()); };
}

auto operation(std::size_t arguments, Apply apply) {
  return then([=](Parsing& parsing) { parsing.add(arguments, apply); });
}

// Parses numbers without a sign. The words "inf" and "nan" are not numbers.
struct NumberPolicies : x3::ureal_policies<double> {
  template <typename Iterator, typename Value>
  static bool parse_nan(Iterator&, const Iterator&, Value&) {
    return false;
  }
  template <typename Iterator, typename Value>
  static bool parse_inf(Iterator&, const Iterator&, Value&) {
    return false;
  }
};

const x3::rule<struct choice_rule> choice = "an expression";
const x3::rule<struct disjunction_rule> disjunction = "an expression";
const x3::rule<struct conjunction_rule> conjunction = "an expression";
const x3::rule<struct comparison_rule> comparison = "an expression";
const x3::rule<struct sum_rule> sum = "an expression";
const x3::rule<struct product_rule> product = "an expression";
const x3::rule<struct signed_rule> signed_number = "a number";
const x3::rule<struct primary_rule> primary = "a number";
const x3::rule<struct name_rule, std::string> name = "a name";

const auto choice_def =
    disjunction >> -('?' > choice > ':' >
                     choice[operation(3, [](Arguments a) { return a[0] != 0.0 ? a[1] : a[2]; })]);
const auto disjunction_def = conjunction >>
                             *("||" > conjunction[operation(2, [](Arguments a) {
                                 return static_cast<double>(a[0] != 0.0 || a[1] != 0.0);
                               })]);
const auto conjunction_def = comparison >>
                             *("&&" > comparison[operation(2, [](Arguments a) {
                                 return static_cast<double>(a[0] != 0.0 && a[1] != 0.0);
                               })]);
const auto comparison_def =
    sum >>
    *(("<=" > sum[operation(2, [](Arguments a) { return static_cast<double>(a[0] <= a[1]); })]) |
      (">=" > sum[operation(2, [](Arguments a) { return static_cast<double>(a[0] >= a[1]); })]) |
      ("==" > sum[operation(2, [](Arguments a) { return static_cast<double>(a[0] == a[1]); })]) |
      ("!=" > sum[operation(2, [](Arguments a) { return static_cast<double>(a[0] != a[1]); })]) |
      ('<' > sum[operation(2, [](Arguments a) { return static_cast<double>(a[0] < a[1]); })]) |
      ('>' > sum[operation(2, [](Arguments a) { return static_cast<double>(a[0] > a[1]); })]));
const auto sum_def = product >>
                     *(('+' > product[operation(2, [](Arguments a) { return a[0] + a[1]; })]) |
                       ('-' > product[operation(2, [](Arguments a) { return a[0] - a[1]; })]));
const auto product_def =
    signed_number >>
    *(('*' > signed_number[operation(2, [](Arguments a) { return a[0] * a[1]; })]) |
      ('/' > signed_number[operation(2, [](Arguments a) { return a[0] / a[1]; })]));
// A power binds tighter than a sign, and powers group from the right: -2^2 is -4, 2^3^2 is 2^9.
const auto signed_number_def =
    ('-' > signed_number[operation(1, [](Arguments a) { return -a[0]; })]) | ('+' > signed_number) |
    (primary >>
     -('^' > signed_number[operation(2, [](Arguments a) { return std::pow(a[0], a[1]); })]));
const auto name_def = x3::lexeme[(x3::alpha | x3::char_('_')) >> *(x3::alnum | x3::char_('_'))];
const auto argument = choice[then([](Parsing& parsing) { ++parsing.counts.back(); })];
const auto primary_def =
    x3::real_parser<double, NumberPolicies>()[([](const auto& context) {
      x3::get<parsing_tag>(context).get().add_constant(x3::_attr(context));
    })] |
    ('(' > choice > ')') |
    (name[([](const auto& context) {
       x3::get<parsing_tag>(context).get().called = x3::_attr(context);
     })] >>
     ((x3::lit('(')[then([](Parsing& parsing) { parsing.begin_call(); })] > -(argument % ',') >
       x3::lit(')')[then([](Parsing& parsing) { parsing.end_call(); })]) |
      x3::eps[then([](Parsing& parsing) { parsing.add_named_number(); })]));

BOOST_SPIRIT_DEFINE(
    choice, disjunction, conjunction, comparison, sum, product, signed_number, primary, name)

// @return the steps of a formula.
// @throws DomainError  if the text is not a formula; the message gives the position.
std::vector<Step> parsed(const std::string& text, const std::vector<std::string>& names) {
  Parsing parsing{.names = names, .steps = {}, .called = {}, .calls = {}, .counts = {}};
  auto at = text.begin();
  try {
    const bool has_start = x3::phrase_parse(
        at, text.end(), x3::with<parsing_tag>(std::ref(parsing))[choice], x3::space);
    if (has_start && at == text.end()) {
      return parsing.steps;
    }
  } catch (const x3::expectation_failure<std::string::const_iterator>& failure) {
    at = failure.where();
    if (at == text.end()) {
      throw DomainError("an operand or a parenthesis is missing at the end");
    }
  }
  throw DomainError(formatted("syntax error at character {}: '{}'", at - text.begin() + 1,
                              std::string(at, text.end()).substr(0, 20)));
}

}  // namespace

struct Formula::Parsed {
  std::vector<std::string> names;
  std::vector<Step> steps;
};

Formula::Formula(const std::string& text, std::vector<std::string> names)
    : text_(text), parsed_(std::make_shared<Parsed>()) {
  constexpr std::size_t longest = 1900;
  constexpr auto deepest = 100;
  if (text.size() > longest) {
    throw DomainError(formatted("the formula '{}...' has {} characters; at most {} are allowed",
                                text.substr(0, 40), text.size(), longest));
  }
  if (std::count(text.begin(), text.end(), '(') > deepest) {
    throw DomainError(
        formatted("the formula '{}...' has more than {} parentheses", text.substr(0, 40), deepest));
  }
  parsed_->names = std::move(names);
  try {
    parsed_->steps = parsed(text, parsed_->names);
  } catch (const DomainError& error) {
    throw DomainError(formatted("the formula '{}': {}", text, error.what()));
  }
}

double Formula::operator()(std::span<const double> values) const noexcept {
  std::vector<double> stack;
  stack.reserve(parsed_->steps.size());
  for (const Step& step : parsed_->steps) {
    switch (step.kind) {
      case Step::constant:
        stack.push_back(step.value);
        break;
      case Step::variable:
        stack.push_back(values[step.variable_at]);
        break;
      case Step::operation: {
        const double value = step.apply(Arguments(stack).last(step.arguments));
        stack.resize(stack.size() - step.arguments);
        stack.push_back(value);
        break;
      }
    }
  }
  return stack.back();
}

bool Formula::has(const std::string& name) const {
  return std::any_of(parsed_->steps.begin(), parsed_->steps.end(), [&](const Step& step) {
    return step.kind == Step::variable && parsed_->names[step.variable_at] == name;
  });
}

}  // namespace axiscal
