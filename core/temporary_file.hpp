// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace axiscal {

/// A file in the folder that TMPDIR names, or in /tmp. It is gone with the object; a signal that
/// ends the program removes its name.
class TemporaryFile {
 public:
  /// @throws OutputError  if none can be made there.
  TemporaryFile();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  /// Removes the name now. The content disappears when the program ends in any way.
  void remove_name();

  /// @return a path by which this process can open it.
  [[nodiscard]] const std::string& path() const { return path_; }

  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  std::string path_;
  bool has_name_ = true;
  int descriptor_ = -1;
};

}  // namespace axiscal
