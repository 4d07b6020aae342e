// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A library that reads recordings.
struct LinkedLibrary {
  std::string name;     ///< "zlib"
  std::string version;  ///< empty if this build does not contain it
  std::string reads;    ///< the files that need it: "gzip, compressed .mat"
};

/// @return all libraries that can read recordings, including those that this build lacks.
[[nodiscard]] std::vector<LinkedLibrary> linked_libraries();

}  // namespace axiscal
