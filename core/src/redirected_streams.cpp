// SPDX-License-Identifier: Apache-2.0
#include "core/redirected_streams.hpp"

#include <cstdio>
#include <utility>

namespace axiscal {
namespace {

thread_local RedirectedStreams* streams = nullptr;

}  // namespace

RedirectedStreams::RedirectedStreams(std::string input)
    : input_(std::move(input)), outer_(std::exchange(streams, this)) {}

RedirectedStreams::~RedirectedStreams() {
  streams = outer_;
}

RedirectedStreams* RedirectedStreams::current() {
  return streams;
}

std::size_t RedirectedStreams::read(char* buffer, std::size_t size) {
  const std::size_t count = input_.copy(buffer, size, at_);
  at_ += count;
  return count;
}

void print_error(std::string_view text) {
  if (streams != nullptr) {
    streams->errors += text;
  } else {
    std::fwrite(text.data(), 1, text.size(), stderr);
  }
}

}  // namespace axiscal
