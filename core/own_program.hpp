// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A program that stands beside the command `axiscal`, as those of git do.
struct OwnProgram {
  const char* name = nullptr;     ///< "axiscal-report"
  const char* package = nullptr;  ///< that installs it
};

/// @return the path of the program. It is sought in the folder that AXISCAL_LIBEXEC names, beside
/// the
///         running program, in ../libexec/axiscal, and where axiscal was installed.
/// @throws RefusedError  if it is in none of them; the message names the package.
[[nodiscard]] std::string own_program(const OwnProgram& program);

/// Becomes the program: it replaces this process.
/// @param arguments  without the program's name.
/// @throws RefusedError  as own_program(); or if it cannot be started.
[[noreturn]] void become(const OwnProgram& program, const std::vector<std::string>& arguments);

}  // namespace axiscal
