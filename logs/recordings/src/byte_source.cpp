// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/byte_source.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <utility>

#ifdef AXISCAL_LIBARCHIVE
#include <archive.h>
#include <archive_entry.h>
#endif

#ifdef AXISCAL_ZLIB
#include <zlib.h>
#endif

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "core/formatted.hpp"
#include "core/late_library.hpp"

namespace axiscal {
namespace {

#ifdef AXISCAL_LIBARCHIVE_LATE
AXISCAL_LATE_LIBRARY(libarchive, AXISCAL_LIBARCHIVE)
AXISCAL_LATE(libarchive, archive_error_string)
AXISCAL_LATE(libarchive, archive_read_data)
AXISCAL_LATE(libarchive, archive_read_free)
AXISCAL_LATE(libarchive, archive_read_new)
AXISCAL_LATE(libarchive, archive_read_next_header)
AXISCAL_LATE(libarchive, archive_read_open)
AXISCAL_LATE(libarchive, archive_read_support_filter_bzip2)
AXISCAL_LATE(libarchive, archive_read_support_filter_compress)
AXISCAL_LATE(libarchive, archive_read_support_filter_lz4)
AXISCAL_LATE(libarchive, archive_read_support_filter_lzip)
AXISCAL_LATE(libarchive, archive_read_support_filter_xz)
AXISCAL_LATE(libarchive, archive_read_support_filter_zstd)
AXISCAL_LATE(libarchive, archive_read_support_format_raw)
AXISCAL_LATE(libarchive, archive_set_error)
#endif

std::string compression_of(std::string_view start) {
  using namespace std::string_view_literals;
  const std::array<std::pair<std::string_view, const char*>, 7> known = {
      {{"\x1f\x8b"sv, "gzip"},
       {"BZh"sv, "bzip2"},
       {"\xfd"
        "7zXZ\0"sv,
        "xz"},
       {"\x28\xb5\x2f\xfd"sv, "zstd"},
       {"\x04\x22\x4d\x18"sv, "lz4"},
       {"\x1f\x9d"sv, "compress"},
       {"LZIP"sv, "lzip"}}};
  for (const auto& [magic, name] : known) {
    if (start.starts_with(magic)) {
      return name;
    }
  }
  return "";
}

}  // namespace

std::string read_up_to(std::size_t size,
                       const std::function<std::size_t(char* buffer, std::size_t size)>& read) {
  constexpr std::size_t piece = 1U << 16U;
  std::string text;
  while (text.size() < size) {
    const std::size_t filled = text.size();
    text.resize(std::min(size, filled + piece));
    const std::size_t count = read(text.data() + filled, text.size() - filled);
    text.resize(filled + count);
    if (count == 0) {
      break;
    }
  }
  return text;
}

// The file, and behind it the unpacker.
struct ByteSource::Reader {
  Reader(std::string name, Read read_file)
      : path(std::move(name)), read_raw(std::move(read_file)) {}

  std::string path;
  Read read_raw;
  std::vector<char> start;  // the first bytes, read to see what they are
  std::size_t start_given = 0;

  std::size_t read_packed(char* buffer, std::size_t size) {
    if (start_given < start.size()) {
      const std::size_t count = std::min(size, start.size() - start_given);
      std::memcpy(buffer, start.data() + start_given, count);
      start_given += count;
      return count;
    }
    return read_raw(buffer, size);
  }

#ifdef AXISCAL_LIBARCHIVE
  struct Free {
    void operator()(archive* a) const { archive_read_free(a); }
  };
  std::unique_ptr<archive, Free> unpacker;
  std::vector<char> packed;
  std::exception_ptr error;  // what reading the file threw; it must not cross libarchive's C code

  static la_ssize_t next_packed(archive* a, void* self, const void** buffer) {
    auto& reader = *static_cast<Reader*>(self);
    try {
      *buffer = reader.packed.data();
      return static_cast<la_ssize_t>(
          reader.read_packed(reader.packed.data(), reader.packed.size()));
    } catch (...) {
      reader.error = std::current_exception();
      archive_set_error(a, -1, "cannot be read");
      return -1;
    }
  }

  void fail() {
    if (error) {
      std::rethrow_exception(error);
    }
    const char* const why = archive_error_string(unpacker.get());
    throw DataError(path, formatted("the compressed file is damaged or cut short ({})",
                                    why != nullptr ? why : "unknown"));
  }

  void unpack() {
    unpacker.reset(archive_read_new());
    packed.resize(1U << 16U);
    // These only: others of libarchive's run programs, or nest.
    archive_read_support_filter_bzip2(unpacker.get());
    archive_read_support_filter_xz(unpacker.get());
    archive_read_support_filter_zstd(unpacker.get());
    archive_read_support_filter_lz4(unpacker.get());
    archive_read_support_filter_compress(unpacker.get());
    archive_read_support_filter_lzip(unpacker.get());
    archive_read_support_format_raw(unpacker.get());
    archive_entry* entry = nullptr;
    if (archive_read_open(unpacker.get(), this, nullptr, next_packed, nullptr) != ARCHIVE_OK ||
        archive_read_next_header(unpacker.get(), &entry) != ARCHIVE_OK) {
      fail();
    }
  }
#endif

#ifdef AXISCAL_ZLIB
  // gzip by zlib itself: libarchive does not look at the checksum and length of what it unpacks.
  struct Inflater {
    z_stream stream{};
    bool in_member = true;
    std::vector<char> packed = std::vector<char>(1U << 16U);
    Inflater() {
      constexpr int gzip_window_bits = 15 + 16;
      inflateInit2(&stream, gzip_window_bits);
    }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;
    ~Inflater() { inflateEnd(&stream); }
  };
  std::unique_ptr<Inflater> inflater;

  [[noreturn]] void fail_gzip(const char* why) const {
    throw DataError(path, formatted("the compressed file is damaged or cut short (gzip: {})", why));
  }

  std::size_t inflate_some(char* buffer, std::size_t size) {
    z_stream& stream = inflater->stream;
    stream.next_out = reinterpret_cast<Bytef*>(buffer);
    stream.avail_out = static_cast<uInt>(size);
    while (stream.avail_out == size) {
      if (stream.avail_in == 0) {
        std::vector<char>& packed_bytes = inflater->packed;
        const std::size_t count = read_packed(packed_bytes.data(), packed_bytes.size());
        stream.next_in = reinterpret_cast<Bytef*>(packed_bytes.data());
        stream.avail_in = static_cast<uInt>(count);
        if (count == 0) {
          if (inflater->in_member) {
            fail_gzip("it ends too early");
          }
          break;
        }
      }
      if (!inflater->in_member) {  // another member follows, as of files put together
        inflateReset(&stream);
        inflater->in_member = true;
      }
      const int status = inflate(&stream, Z_NO_FLUSH);
      if (status == Z_STREAM_END) {
        inflater->in_member = false;
      } else if (status != Z_OK && status != Z_BUF_ERROR) {
        fail_gzip(stream.msg != nullptr ? stream.msg : "bad data");
      }
    }
    return size - stream.avail_out;
  }
#endif

  std::size_t read(char* buffer, std::size_t size) {
#ifdef AXISCAL_ZLIB
    if (inflater) {
      return inflate_some(buffer, size);
    }
#endif
#ifdef AXISCAL_LIBARCHIVE
    if (unpacker) {
      const la_ssize_t count = archive_read_data(unpacker.get(), buffer, size);
      if (count < 0) {
        fail();
      }
      return static_cast<std::size_t>(count);
    }
#endif
    return read_packed(buffer, size);
  }
};

ByteSource::Opened ByteSource::open_file(const std::string& path, const ReadLimits& limits) {
  const auto file = std::make_shared<InputFile>(path);
  if (file->size() == 0) {
    return open_pipe([file](char* buffer, std::size_t size) { return file->read(buffer, size); },
                     ReadBudget(path, limits));
  }
  Opened opened{.read = [file](char* buffer, std::size_t size) { return file->read(buffer, size); },
                .budget = ReadBudget(path, limits),
                .is_file = true};
  opened.budget.add_file_bytes(file->size());
  return opened;
}

// The size of a pipe is not known: it grows with what is read.
ByteSource::Opened ByteSource::open_pipe(Read read, const ReadBudget& budget) {
  return {.read =
              [read = std::move(read), budget](char* buffer, std::size_t size) {
                const std::size_t count = read(buffer, size);
                budget.add_file_bytes(count);
                return count;
              },
          .budget = budget};
}

ByteSource::ByteSource(const std::string& path, const ReadLimits& limits)
    : ByteSource(path, open_file(path, limits)) {}

ByteSource::ByteSource(const std::string& path, Read read, const ReadLimits& limits)
    : ByteSource(path, open_pipe(std::move(read), ReadBudget(path, limits))) {}

ByteSource::ByteSource(std::string path, Read read, ReadBudget budget)
    : ByteSource(std::move(path), Opened{.read = std::move(read), .budget = std::move(budget)}) {}

ByteSource::ByteSource(std::string path, Opened opened)
    : path_(std::move(path)),
      is_file_(opened.is_file),
      budget_(std::move(opened.budget)),
      reader_(std::make_unique<Reader>(path_, std::move(opened.read))) {
  constexpr std::size_t longest_magic = 6;
  std::vector<char>& start = reader_->start;
  start.resize(longest_magic);
  std::size_t filled = 0;
  while (filled < longest_magic) {
    const std::size_t count = reader_->read_raw(start.data() + filled, longest_magic - filled);
    if (count == 0) {
      break;
    }
    filled += count;
  }
  start.resize(filled);
  compression_ = compression_of({start.data(), start.size()});
  if (!compression_.empty()) {
    budget_ = budget_.within();
    is_file_ = false;
  }
#ifdef AXISCAL_ZLIB
  if (compression_ == "gzip") {
    reader_->inflater = std::make_unique<Reader::Inflater>();
    return;
  }
#endif
  if (!compression_.empty()) {
#ifdef AXISCAL_LIBARCHIVE
    reader_->unpack();
#else
    throw DataError(path_, "is compressed (" + compression_ +
                               "), and this axiscal was built without libarchive; unpack it first");
#endif
  }
}

ByteSource::~ByteSource() = default;
ByteSource::ByteSource(ByteSource&&) noexcept = default;
ByteSource& ByteSource::operator=(ByteSource&&) noexcept = default;

// Piece by piece, so that a short file costs few pages of memory.
std::string_view ByteSource::peek(std::size_t size) {
  constexpr std::size_t least = 4096;
  while (ahead_.size() - next_ < size) {
    const std::size_t had = ahead_.size();
    ahead_.resize(std::min(next_ + size, had + std::max(had, least)));
    const std::size_t count = read_on(ahead_.data() + had, ahead_.size() - had);
    ahead_.resize(had + count);
    if (count == 0) {
      break;
    }
  }
  return {ahead_.data() + next_, std::min(size, ahead_.size() - next_)};
}

std::size_t ByteSource::read(char* buffer, std::size_t size) {
  if (next_ < ahead_.size()) {
    const std::size_t count = std::min(size, ahead_.size() - next_);
    std::memcpy(buffer, ahead_.data() + next_, count);
    next_ += count;
    return count;
  }
  return read_on(buffer, size);
}

std::size_t ByteSource::read_on(char* buffer, std::size_t size) {
  if (size == 0) {
    return 0;  // an unpacker would go on without an end
  }
  const std::size_t count = reader_->read(buffer, size);
  if (!compression_.empty()) {
    budget_.spend(ReadCost::unpacked, count);
  }
  return count;
}

ByteSource bytes_of_pieces(std::string path,
                           std::function<bool(std::string& piece)> next,
                           ReadBudget budget) {
  return {std::move(path),
          [next = std::move(next), piece = std::string(), given = std::size_t{0}](
              char* buffer, std::size_t size) mutable {
            while (given == piece.size()) {
              piece.clear();
              given = 0;
              if (!next(piece)) {
                return std::size_t{0};
              }
            }
            const std::size_t count = piece.copy(buffer, size, given);
            given += count;
            return count;
          },
          std::move(budget)};
}

}  // namespace axiscal
