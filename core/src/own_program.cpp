// SPDX-License-Identifier: Apache-2.0
#include "core/own_program.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>

#include <system_error>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

namespace fs = std::filesystem;

// Returns the folder of the program or library that contains this code (for example the Python
// module); empty if it is unknown.
fs::path folder_of_this_code() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<void*>(&folder_of_this_code), &info) == 0 ||
      info.dli_fname == nullptr) {
    return {};
  }
  std::error_code failed;
  const fs::path file = fs::canonical(info.dli_fname, failed);
  return failed ? fs::path() : file.parent_path();
}

std::vector<fs::path> folders_of_programs() {
  std::vector<fs::path> folders;
  if (const char* const stated = std::getenv("AXISCAL_LIBEXEC"); stated != nullptr) {
    folders.emplace_back(stated);
  }
  std::error_code failed;
  const fs::path running = fs::read_symlink("/proc/self/exe", failed);
  if (!running.empty()) {
    folders.push_back(running.parent_path());
    folders.push_back(running.parent_path() / AXISCAL_LIBEXEC_FROM_BIN);
  }
  if (const fs::path own = folder_of_this_code(); !own.empty()) {
    folders.push_back(own);
    folders.push_back(own / "../../cli");  // for the Python module in a build folder
  }
  folders.emplace_back(AXISCAL_LIBEXEC_FOLDER);
  return folders;
}

}  // namespace

std::string own_program(const OwnProgram& program) {
  for (const fs::path& folder : folders_of_programs()) {
    const fs::path file = folder / program.name;
    if (::access(file.c_str(), X_OK) == 0) {
      return file.string();
    }
  }
  throw RefusedError(
      formatted("{} is not installed; install the package {}", program.name, program.package));
}

void become(const OwnProgram& program, const std::vector<std::string>& arguments) {
  std::string file = own_program(program);
  std::vector<std::string> words = arguments;
  std::vector<char*> argv = {file.data()};
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  ::execv(file.c_str(), argv.data());
  throw RefusedError(formatted("{} cannot be started: {}", file, std::strerror(errno)));
}

}  // namespace axiscal
