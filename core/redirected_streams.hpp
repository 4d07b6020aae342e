// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// The standard streams of this thread as strings, for a program that runs subcommands within
/// itself. While an object lives, the path "-" reads `input` and writes `output`; print_error()
/// writes `errors`. Other threads keep the streams of the process.
class AXISCAL_EXPORT RedirectedStreams {
 public:
  explicit RedirectedStreams(std::string input);
  ~RedirectedStreams();
  RedirectedStreams(const RedirectedStreams&) = delete;
  RedirectedStreams& operator=(const RedirectedStreams&) = delete;

  /// @return those of this thread; null if its streams are the process's.
  [[nodiscard]] static RedirectedStreams* current();

  /// Reads on in `input`. @return the number of bytes; 0 at the end.
  std::size_t read(char* buffer, std::size_t size);

  std::string output;
  std::string errors;

 private:
  std::string input_;
  std::size_t at_ = 0;
  RedirectedStreams* outer_;
};

/// Writes text to standard error, or to RedirectedStreams::errors.
AXISCAL_EXPORT void print_error(std::string_view text);

}  // namespace axiscal
