// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace axiscal {

/// A library by which this build reads recordings.
struct LinkedLibrary {
  std::string name;     ///< "zlib"
  std::string version;  ///< empty: this build is without it
  std::string reads;    ///< the files that need it: "gzip, compressed .mat"
};

/// @return the libraries by which recordings can be read, whether or not this build has them.
[[nodiscard]] std::vector<LinkedLibrary> linked_libraries();

}  // namespace axiscal
