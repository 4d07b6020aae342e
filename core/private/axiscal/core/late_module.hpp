// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dlfcn.h>
#include <filesystem>
#include <string>

#include <system_error>

#include "axiscal/core/error.hpp"

namespace axiscal {

/// A symbol of a module of ours, which lies in the folder of modules of the build tree that the
/// program is of, where the program is installed, or where the library is.
/// @throws RefusedError  where it is not there.
[[nodiscard]] inline void* module_symbol(const char* module, const char* name) {
  std::error_code failed;
  const std::filesystem::path program =
      std::filesystem::read_symlink("/proc/self/exe", failed).parent_path();
  std::string why;
  for (const std::filesystem::path& folder :
       {program / "../modules", program / AXISCAL_MODULES_FROM_PROGRAM,
        std::filesystem::path(AXISCAL_MODULES_INSTALLED)}) {
    if (folder.is_relative()) {
      continue;  // nobody knows where the program is, and the working folder is anybody's
    }
    void* const library = ::dlopen((folder / module).c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const found = library != nullptr ? ::dlsym(library, name) : nullptr;
    if (found != nullptr) {
      return found;
    }
    const char* const error = ::dlerror();
    why += std::string(why.empty() ? "" : "; ") + (error != nullptr ? error : "it lacks a symbol");
  }
  throw RefusedError(std::string("the module ") + module +
                     " cannot be loaded; install axiscal again, and what it needs (" + why + ")");
}

}  // namespace axiscal
