// SPDX-License-Identifier: Apache-2.0
#include "core/temporary_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "core/unfinished_names.hpp"

namespace axiscal {

TemporaryFile::TemporaryFile() {
  const char* const stated = std::getenv("TMPDIR");  // NOLINT(concurrency-mt-unsafe)
  if (stated != nullptr && *stated == 0) {
    throw OutputError(
        "the environment variable TMPDIR is empty: set it to a folder for temporary "
        "files, or unset it");
  }
  const std::string folder = stated != nullptr ? stated : "/tmp";
  path_ = folder + "/axiscal-XXXXXX";
  descriptor_ = ::mkostemp(path_.data(), O_CLOEXEC);
  if (descriptor_ < 0) {
    throw OutputError(
        formatted("{}: a temporary file cannot be created in this folder ({}); name another folder "
                  "in TMPDIR",
                  folder, std::strerror(errno)));
  }
  register_unfinished_file(path_);
}

TemporaryFile::~TemporaryFile() {
  if (has_name_) {
    remove_name();
  }
  ::close(descriptor_);
}

void TemporaryFile::remove_name() {
  ::unlink(path_.c_str());
  unregister_unfinished_file(path_);
  has_name_ = false;
  path_ = formatted("/proc/self/fd/{}", descriptor_);
}

}  // namespace axiscal
