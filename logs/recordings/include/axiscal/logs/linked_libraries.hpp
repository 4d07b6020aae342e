// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A library that reads recordings.
struct LinkedLibrary {
  std::string name;     ///< name of the library, such as "zlib"
  std::string version;  ///< empty if this build does not contain it
  std::string reads;    ///< files that need the library: "gzip, compressed .mat"
};

/// @return all libraries that axiscal can use to read recordings, including those that this build
///         lacks.
[[nodiscard]] std::vector<LinkedLibrary> linked_libraries();

}  // namespace axiscal
