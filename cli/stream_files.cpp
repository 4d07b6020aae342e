// SPDX-License-Identifier: Apache-2.0
#include "stream_files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

#include <fcntl.h>
#include <unistd.h>
#ifdef AXISCAL_ZSTD
#include <zstd.h>
#endif

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/descriptor.hpp"
#include "core/formatted.hpp"
#include "core/redirected_streams.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

bool is_compressed(const std::string& path) {
  return path.ends_with(".zst");
}

#ifndef AXISCAL_ZSTD
[[noreturn]] void refuse_zstd(const std::string& path) {
  throw UsageError(path + ": this build lacks zstd; use a file name without .zst");
}
#endif

// Calls `take` for each complete line of a text, until `take` returns false.
// @param more  is set to false if `take` has returned false.
// @return the number of bytes of the lines for which `take` returned true.
std::size_t take_lines(std::string_view text, const TakeLine& take, bool& more) {
  std::size_t at = 0;
  for (std::size_t end = text.find('\n'); more && end != std::string_view::npos;
       end = text.find('\n', at)) {
    more = take(text.substr(at, end - at));
    at = more ? end + 1 : at;
  }
  return at;
}

// A file that is open for reading. Unlike an InputFile, it may be overwritten later.
struct LineSource {
  explicit LineSource(std::string name)
      : path(std::move(name)), descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (descriptor < 0) {
      throw DataError(path, errno == ENOENT ? "no such file" : std::strerror(errno));
    }
  }
  ~LineSource() { ::close(descriptor); }
  LineSource(const LineSource&) = delete;
  LineSource& operator=(const LineSource&) = delete;

  std::size_t read(char* buffer, std::size_t size) const {
    ssize_t count = ::read(descriptor, buffer, size);
    while (count < 0 && errno == EINTR) {
      count = ::read(descriptor, buffer, size);
    }
    if (count < 0) {
      throw DataError(path, std::string("cannot be read: ") + std::strerror(errno));
    }
    return static_cast<std::size_t>(count);
  }

  std::string path;
  int descriptor;
};

#ifdef AXISCAL_ZSTD
// Reads the lines of a compressed file. LineFile writes whole lines into each zstd frame of the
// file.
std::size_t read_frames(LineSource& file, const TakeLine& take) {
  std::string bytes;
  std::size_t done = 0;
  std::vector<char> buffer(1U << 20U);
  bool more = true;
  for (std::size_t count = file.read(buffer.data(), buffer.size()); more;
       count = file.read(buffer.data(), buffer.size())) {
    bytes.append(buffer.data(), count);
    std::size_t at = 0;
    while (more && at < bytes.size()) {
      const std::size_t size = ZSTD_findFrameCompressedSize(bytes.data() + at, bytes.size() - at);
      if (ZSTD_isError(size) != 0) {
        break;  // the frame is incomplete: more bytes must be read, or the writer was killed
      }
      const unsigned long long length = ZSTD_getFrameContentSize(bytes.data() + at, size);
      constexpr unsigned long long most = 1ULL << 30U;
      if (length > most) {
        throw DataError(file.path, "was not written by `calibrate --stream`");
      }
      std::string text(length, '\0');
      if (ZSTD_isError(ZSTD_decompress(text.data(), text.size(), bytes.data() + at, size)) != 0) {
        more = false;
        break;
      }
      const std::size_t taken = take_lines(text, take, more);
      if (taken == text.size()) {
        at += size;
        done += size;
      }
    }
    bytes.erase(0, at);
    if (count == 0) {
      break;
    }
  }
  return done;
}
#endif

}  // namespace

std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  }
  return hash;
}

bool is_in_shard(const Shard& shard, std::string_view serial) {
  return hash_of(serial) % static_cast<std::uint64_t>(shard.count) ==
         static_cast<std::uint64_t>(shard.number - 1);
}

Shard shard_of_option(const std::string& text) {
  const std::size_t slash = text.find('/');
  const std::optional<int> number =
      slash == std::string::npos ? std::nullopt : parse_integer(text.substr(0, slash));
  const std::optional<int> count =
      slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1));
  if (!number || !count || *number < 1 || *number > *count) {
    throw UsageError(formatted("--shard: '{}' must be I/N with 1 <= I <= N", text));
  }
  return {.number = *number, .count = *count};
}

std::size_t read_complete_lines(const std::string& path, const TakeLine& take) {
  LineSource file(path);
  if (is_compressed(path)) {
#ifdef AXISCAL_ZSTD
    return read_frames(file, take);
#else
    refuse_zstd(path);
#endif
  }
  std::string text;
  std::size_t done = 0;
  std::vector<char> buffer(1U << 20U);
  bool more = true;
  for (std::size_t count = file.read(buffer.data(), buffer.size()); more && count > 0;
       count = file.read(buffer.data(), buffer.size())) {
    text.append(buffer.data(), count);
    const std::size_t taken = take_lines(text, take, more);
    text.erase(0, taken);
    done += taken;
  }
  return done;
}

LineFile::LineFile(std::string path, std::size_t keep)
    : path_(std::move(path)), compressed_(is_compressed(path_)) {
#ifndef AXISCAL_ZSTD
  if (compressed_) {
    refuse_zstd(path_);
  }
#endif
  if (path_ == "-") {
    descriptor_ = STDOUT_FILENO;
    return;
  }
  forbid_replacing_input(path_);
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0 || (::ftruncate(descriptor_, static_cast<off_t>(keep)) != 0 && keep > 0) ||
      ::lseek(descriptor_, 0, SEEK_END) < 0) {
    const std::string why = std::strerror(errno);
    if (descriptor_ < 0 || errno != ESPIPE) {
      throw OutputError(formatted("{}: cannot be written ({})", path_, why));
    }
  }
}

LineFile::~LineFile() {
  if (descriptor_ >= 0 && path_ != "-") {
    ::close(descriptor_);
  }
}

void LineFile::write(std::string_view lines) {
  if (lines.empty()) {
    return;
  }
  std::string packed;
#ifdef AXISCAL_ZSTD
  if (compressed_) {
    packed.resize(ZSTD_compressBound(lines.size()));
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), lines.data(), lines.size(), 3);
    if (ZSTD_isError(size) != 0) {
      throw OutputError(formatted("{}: cannot be compressed ({})", path_, ZSTD_getErrorName(size)));
    }
    packed.resize(size);
    lines = packed;
  }
#endif
  if (path_ == "-" && RedirectedStreams::current() != nullptr) {
    RedirectedStreams::current()->output += lines;
    return;
  }
  if (!write_all(descriptor_, lines)) {
    const std::string name = path_ == "-" ? "standard output" : path_;
    if (errno == EPIPE) {
      throw ClosedPipe(name + ": was closed by the program that reads it");
    }
    throw OutputError(formatted(
        "{}: cannot be written ({}); use --resume to continue after the last complete line", name,
        std::strerror(errno)));
  }
}

}  // namespace axiscal::cli
