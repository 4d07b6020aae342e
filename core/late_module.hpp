// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dlfcn.h>
#include <filesystem>
#include <string>
#include <vector>

#include <system_error>

#include "axiscal/core/error.hpp"

namespace axiscal {

/// Where files that belong to the program lie. Its targets are set up by axiscal_find_own_files().
/// @return the build tree's folder if the program is of the build tree. Else the folder beside the
///         program's, and the folder where axiscal was installed.
[[nodiscard]] inline std::vector<std::filesystem::path> folders_of_own_files() {
  std::error_code failed;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed);
  if (program.string().starts_with(AXISCAL_BUILD_TREE "/")) {
    return {AXISCAL_OWN_FILES_BUILT};
  }
  std::vector<std::filesystem::path> folders;
  if (program.is_absolute()) {  // else nobody knows where the program is
    folders.push_back(program.parent_path() / AXISCAL_OWN_FILES_FROM_PROGRAM);
  }
  folders.emplace_back(AXISCAL_OWN_FILES_INSTALLED);
  return folders;
}

/// @return a file that belongs to the program.
/// @throws RefusedError  if it is not there.
[[nodiscard]] inline std::string own_file(const char* name) {
  std::string looked_at;
  for (const std::filesystem::path& folder : folders_of_own_files()) {
    std::error_code failed;
    const std::filesystem::path file = folder / name;
    if (std::filesystem::is_regular_file(file, failed)) {
      return file.string();
    }
    looked_at += (looked_at.empty() ? "" : ", ") + file.string();
  }
  throw RefusedError(std::string(name) + " is not there; install axiscal again (" + looked_at +
                     ")");
}

/// @return a symbol of a module of ours.
/// @throws RefusedError  if it is not there.
[[nodiscard]] inline void* module_symbol(const char* module, const char* name) {
  void* const library = ::dlopen(own_file(module).c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = library != nullptr ? ::dlsym(library, name) : nullptr;
  if (found == nullptr) {
    const char* const error = ::dlerror();
    throw RefusedError(std::string("the module ") + module +
                       " cannot be loaded; install axiscal again, and what it needs (" +
                       (error != nullptr ? error : "it lacks a symbol") + ")");
  }
  return found;
}

}  // namespace axiscal
