// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace axiscal::fuzz {

/// A file of records, taken apart so that one of them can be changed and the file stays whole.
struct RecordFile {
  std::string start;                  ///< what stands before the records
  std::vector<std::string> payloads;  ///< of the records
  std::vector<std::string> heads;     ///< what tells a record's kind, beside its length
};

/// A format of which lengths and checksums are mended after a change.
struct RecordFormat {
  std::string_view target;  ///< whose inputs are of it
  RecordFile (*parse)(std::string_view bytes);
  std::string (*join)(const RecordFile& file);
};

/// @return the format of a target; null if it has none.
[[nodiscard]] const RecordFormat* format_of_target(std::string_view target);

/// Changes a file: a record's payload (by libFuzzer's own mutations), or the order of records.
/// @return the bytes of the new file in `data`.
std::size_t mutate_records(const RecordFormat& format,
                           unsigned char* data,
                           std::size_t size,
                           std::size_t max_size,
                           unsigned seed);

}  // namespace axiscal::fuzz
