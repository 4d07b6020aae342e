// SPDX-License-Identifier: Apache-2.0
#include "formulas/src/formula.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <utility>

#ifdef AXISCAL_MUPARSER
#include <muParserDLL.h>
#endif

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "core/formatted.hpp"
#include "core/late_library.hpp"

namespace axiscal {

#ifdef AXISCAL_MUPARSER

namespace {

#ifdef AXISCAL_MUPARSER_LATE
AXISCAL_LATE_LIBRARY(libmuparser, AXISCAL_MUPARSER)
AXISCAL_LATE(libmuparser, mupCreate)
AXISCAL_LATE(libmuparser, mupDefineConst)
AXISCAL_LATE(libmuparser, mupDefineFun2)
AXISCAL_LATE(libmuparser, mupDefineVar)
AXISCAL_LATE(libmuparser, mupError)
AXISCAL_LATE(libmuparser, mupEval)
AXISCAL_LATE(libmuparser, mupGetErrorMsg)
AXISCAL_LATE(libmuparser, mupGetExprVar)
AXISCAL_LATE(libmuparser, mupGetExprVarNum)
AXISCAL_LATE(libmuparser, mupRelease)
AXISCAL_LATE(libmuparser, mupSetExpr)
#endif

double hypotenuse(double a, double b) {
  return std::hypot(a, b);
}

struct ReleaseParser {
  void operator()(void* parser) const { mupRelease(parser); }
};

}  // namespace

// muParser evaluates by the numbers at the addresses that it was given, one thread at a time.
struct Formula::Parsed {
  std::vector<double> values;
  std::vector<std::string> used;
  std::unique_ptr<void, ReleaseParser> parser{mupCreate(muBASETYPE_FLOAT)};
  std::mutex one_at_a_time;
};

Formula::Formula(const std::string& text, std::vector<std::string> names)
    : text_(text), parsed_(std::make_shared<Parsed>()) {
  constexpr std::size_t longest = 1900;  // muParser's messages, which hold it, have 2048
  if (text.size() > longest) {
    throw DomainError(formatted("the formula '{}...': has {} characters; at most {} are read",
                                text.substr(0, 40), text.size(), longest));
  }
  parsed_->values.resize(names.size());
  void* const parser = parsed_->parser.get();
  const auto must = [&] {
    if (mupError(parser) != 0) {
      throw DomainError(formatted("the formula '{}': {}", text, mupGetErrorMsg(parser)));
    }
  };
  mupDefineFun2(parser, "hypot", hypotenuse, 1);
  mupDefineConst(parser, "pi", std::numbers::pi);
  for (std::size_t i = 0; i < names.size(); ++i) {
    mupDefineVar(parser, names[i].c_str(), &parsed_->values[i]);
    must();
  }
  mupSetExpr(parser, text.c_str());
  must();
  const int used = mupGetExprVarNum(parser);
  must();
  for (int i = 0; i < used; ++i) {
    const char* name = nullptr;
    double* address = nullptr;
    mupGetExprVar(parser, static_cast<unsigned>(i), &name, &address);
    parsed_->used.emplace_back(name);
  }
  static_cast<void>(mupEval(parser));
  must();
}

double Formula::operator()(std::span<const double> values) const noexcept {
  const std::scoped_lock lock(parsed_->one_at_a_time);
  std::copy(values.begin(), values.end(), parsed_->values.begin());
  const double value = mupEval(parsed_->parser.get());
  return mupError(parsed_->parser.get()) != 0 ? not_a_number : value;
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
