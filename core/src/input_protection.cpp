// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/input_protection.hpp"

#include <map>
#include <mutex>
#include <utility>

#include <sys/stat.h>

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

enum class Use { read, written };

// The files that must not be replaced, by device and inode.
struct Registry {
  std::mutex mutex;
  int protections = 0;
  std::map<std::pair<dev_t, ino_t>, Use> files;
};

Registry& registry() {
  static Registry files;
  return files;
}

void remember(const struct stat& status, Use use) {
  if (!S_ISREG(status.st_mode)) {
    return;
  }
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  if (all.protections > 0) {
    all.files.emplace(std::pair(status.st_dev, status.st_ino), use);
  }
}

void remember(int descriptor, Use use) {
  struct stat status {};
  if (::fstat(descriptor, &status) == 0) {
    remember(status, use);
  }
}

void forbid(const struct stat& status, const std::string& name) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  const auto found = all.files.find({status.st_dev, status.st_ino});
  if (S_ISREG(status.st_mode) && found != all.files.end()) {
    throw InputOverwriteError(name +
                              (found->second == Use::read
                                   ? ": is an input of this command and would be overwritten"
                                   : ": was already written by this command and would be "
                                     "overwritten") +
                              "; name another file for the output");
  }
}

}  // namespace

InputProtection::InputProtection() {
  const std::lock_guard lock(registry().mutex);
  ++registry().protections;
}

InputProtection::~InputProtection() {
  const std::lock_guard lock(registry().mutex);
  if (--registry().protections == 0) {
    registry().files.clear();
  }
}

void protect_input(int descriptor) {
  remember(descriptor, Use::read);
}

void protect_input(const struct stat& status) {
  remember(status, Use::read);
}

void protect_output(int descriptor) {
  remember(descriptor, Use::written);
}

void allow_rewriting(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return;
  }
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  const auto found = all.files.find({status.st_dev, status.st_ino});
  if (found != all.files.end() && found->second == Use::written) {
    all.files.erase(found);
  }
}

void forbid_replacing_input(const std::string& path) {
  struct stat status {};
  if (path != "-" && ::stat(path.c_str(), &status) == 0) {
    forbid(status, path);
  }
}

void forbid_replacing_input(int descriptor, const std::string& name) {
  struct stat status {};
  if (::fstat(descriptor, &status) == 0) {
    forbid(status, name);
  }
}

}  // namespace axiscal
