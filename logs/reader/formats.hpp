// SPDX-License-Identifier: Apache-2.0
// The readers of the program axiscal-read. If a file cannot be read, a reader throws an Error whose
// message states the reason, without the path.
#pragma once

#include <string>

#include "logs/recordings/src/series_tables.hpp"

namespace axiscal {

[[nodiscard]] SeriesTables read_mat73(const std::string& path);
[[nodiscard]] SeriesTables read_hdf5(const std::string& path);

/// @throws Error  if a dataset of an HDF5 file stores its numbers in another file.
void refuse_foreign_storage(const std::string& path);

}  // namespace axiscal
