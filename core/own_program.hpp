// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A helper program that is installed together with the command `axiscal`, like the programs in
/// git's libexec folder.
struct OwnProgram {
  const char* name = nullptr;     ///< for example "axiscal-report"
  const char* package = nullptr;  ///< the software package that contains the program
};

/// @return the path of the program. It is searched for in these folders, in this order: the folder
///         that AXISCAL_LIBEXEC names, the folder of the running program, ../libexec/axiscal
///         relative to that folder, the folder of this library, and the folder of the installation.
/// @throws RefusedError  if none of these folders has the program. The message names the package.
[[nodiscard]] std::string own_program(const OwnProgram& program);

/// Replaces this process by the program, as exec() does.
/// @param arguments  the arguments after the program's name.
/// @throws RefusedError  if the program is not found or cannot be started.
[[noreturn]] void become(const OwnProgram& program, const std::vector<std::string>& arguments);

}  // namespace axiscal
