// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include <system_error>
#include <unistd.h>

#include "axiscal/core/error.hpp"

namespace axiscal {

/// A file for libraries that write to files only; it is gone with the object.
class TemporaryFile {
 public:
  /// @throws OutputError  where none can be made.
  TemporaryFile() {
    std::string pattern = (std::filesystem::temp_directory_path() / "axiscal-XXXXXX").string();
    const int descriptor = mkstemp(pattern.data());
    if (descriptor < 0) {
      throw OutputError(pattern + ": cannot make a temporary file");
    }
    close(descriptor);
    path_ = pattern;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace axiscal
