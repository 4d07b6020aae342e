// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <dlfcn.h>
#include <string>

#include "axiscal/core/error.hpp"

namespace axiscal {

/// A shared library that few commands need: it is loaded when one of its functions is first called,
/// so that a program that needs none of it starts without it.
struct LateLibrary {
  const char* file;  ///< its soname, as the system's loader finds it
  const char* package;

  /// @return where a symbol is.
  /// @throws RefusedError  where the library, or the symbol in it, is not there.
  [[nodiscard]] void* symbol(const char* name) const {
    void* const library = ::dlopen(file, RTLD_NOW | RTLD_LOCAL);
    void* const found = library != nullptr ? ::dlsym(library, name) : nullptr;
    if (found == nullptr) {
      const char* const why = ::dlerror();
      const std::string what = *package != 0 ? std::string("the package ") + package : "it";
      throw RefusedError(std::string(file) + " cannot be loaded; install " + what +
                         (why != nullptr ? std::string(" (") + why + ")" : std::string()));
    }
    return found;
  }
};

/// A function of it. Declared by AXISCAL_LATE in the namespace that calls it, under its own name,
/// it is what a call finds there; without the declaration the library has to be linked.
template <typename Function>
class LateFunction {
 public:
  constexpr LateFunction(const LateLibrary& library, const char* name)
      : library_(library), name_(name) {}

  operator Function*() const {  // NOLINT: a call converts
    void* found = found_.load(std::memory_order_acquire);
    if (found == nullptr) {
      found = library_.symbol(name_);
      found_.store(found, std::memory_order_release);
    }
    return reinterpret_cast<Function*>(found);
  }

 private:
  const LateLibrary& library_;
  const char* name_;
  mutable std::atomic<void*> found_ = nullptr;
};

/// A variable of it.
template <typename Value>
class LateVariable {
 public:
  constexpr LateVariable(const LateLibrary& library, const char* name)
      : library_(library), name_(name) {}

  operator Value() const {  // NOLINT: as the variable itself
    return *static_cast<const Value*>(library_.symbol(name_));
  }

 private:
  const LateLibrary& library_;
  const char* name_;
};

}  // namespace axiscal

#define AXISCAL_LATE_LIBRARY(NAME, DEFINITION) \
  [[maybe_unused]] constexpr ::axiscal::LateLibrary NAME{DEFINITION##_FILE, DEFINITION##_PACKAGE};
// What a function's declaration says beside its type, as of formats, is said in vain here.
#define AXISCAL_LATE(LIBRARY, FUNCTION)                                                     \
  _Pragma("GCC diagnostic push") _Pragma("GCC diagnostic ignored \"-Wignored-attributes\"") \
      const ::axiscal::LateFunction<decltype(::FUNCTION)>                                   \
          FUNCTION{LIBRARY, #FUNCTION};                                                     \
  _Pragma("GCC diagnostic pop")
#define AXISCAL_LATE_VARIABLE(LIBRARY, VARIABLE) \
  const ::axiscal::LateVariable<decltype(::VARIABLE)> VARIABLE{LIBRARY, #VARIABLE};
