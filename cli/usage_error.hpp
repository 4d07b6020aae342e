// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/error.hpp"

namespace axiscal::cli {

/// Error in the command line. The exit status is 2.
class UsageError : public Error {
 public:
  using Error::Error;

  /// @param where  the subcommand or option whose value caused the error of the library.
  UsageError(const std::string& where, const Error& error)
      : Error(where + ": " + error.what(), error.settings()) {}
};

}  // namespace axiscal::cli
