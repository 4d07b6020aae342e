// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// Redirects the standard streams of this thread to strings, so that a program can run subcommands
/// in its own process. While an object of this class exists, the path "-" means `input` for reading
/// and `output` for writing, and print_error() appends to `errors`. Other threads keep the streams
/// of the process.
class AXISCAL_EXPORT RedirectedStreams {
 public:
  explicit RedirectedStreams(std::string input);
  ~RedirectedStreams();
  RedirectedStreams(const RedirectedStreams&) = delete;
  RedirectedStreams& operator=(const RedirectedStreams&) = delete;

  /// @return the object that redirects the streams of this thread; null if there is none.
  [[nodiscard]] static RedirectedStreams* current();

  /// Reads the next bytes of `input`. @return the number of bytes; 0 at the end.
  std::size_t read(char* buffer, std::size_t size);

  std::string output;
  std::string errors;

 private:
  std::string input_;
  std::size_t at_ = 0;
  RedirectedStreams* outer_;
};

/// Writes text to standard error, or to RedirectedStreams::errors if the streams are redirected.
AXISCAL_EXPORT void print_error(std::string_view text);

}  // namespace axiscal
