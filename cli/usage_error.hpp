// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/error.hpp"

namespace axiscal::cli {

/// The command line is wrong: exit status 2.
class UsageError : public Error {
 public:
  using Error::Error;
};

}  // namespace axiscal::cli
