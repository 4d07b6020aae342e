// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace axiscal {

/// A temporary file in the folder that TMPDIR names, or in /tmp. The destructor removes it. If a
/// signal ends the program, the signal handler removes it.
class TemporaryFile {
 public:
  /// @throws OutputError  if the file cannot be created.
  TemporaryFile();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Removes the file from its folder, but keeps it open. The system deletes its content when the
  /// program ends, even if the program is killed.
  void remove_name();

  /// @return a path by which this process can open the file.
  [[nodiscard]] const std::string& path() const { return path_; }

  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  std::string path_;
  bool has_name_ = true;
  int descriptor_ = -1;
};

}  // namespace axiscal
