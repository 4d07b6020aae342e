// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace axiscal::fuzz {

/// A file that is parsed into records, so that one record can be changed and the file remains
/// valid.
struct RecordFile {
  std::string start;                  ///< bytes before the records
  std::vector<std::string> payloads;  ///< payloads of the records
  std::vector<std::string> heads;     ///< heads without lengths: kind of each record
};

/// A format whose lengths and checksums are corrected after a change.
struct RecordFormat {
  std::string_view target;  ///< the fuzz target with this format
  RecordFile (*parse)(std::string_view bytes);
  std::string (*join)(const RecordFile& file);
};

/// @return the format of a target; nullptr if it has no format.
[[nodiscard]] const RecordFormat* format_of_target(std::string_view target);

/// Changes the payload of a record (by libFuzzer's mutations) or the order of the records. Writes
/// the new file to `data`.
/// @return the size of the new file [bytes].
std::size_t mutate_records(const RecordFormat& format,
                           unsigned char* data,
                           std::size_t size,
                           std::size_t max_size,
                           unsigned seed);

}  // namespace axiscal::fuzz
