// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/byte_source.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <optional>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/unpacker.hpp"

namespace axiscal {
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

// Reads bytes from a function, and unpacks them if they are compressed.
struct ByteSource::Reader {
  Reader(std::string name, Read read_file)
      : path(std::move(name)), read_raw(std::move(read_file)) {}

  std::string path;
  Read read_raw;
  std::vector<char> start;  // the first bytes, read to detect compression
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

  std::optional<Unpacker> unpacker;

  std::size_t read(char* buffer, std::size_t size) {
    if (!unpacker) {
      return read_packed(buffer, size);
    }
    try {
      return unpacker->read(buffer, size);
    } catch (const DamagedStream& error) {
      throw DataError(path,
                      formatted("the compressed file is damaged or cut short ({})", error.what()));
    }
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

// The size of a pipe is not known in advance, so each read adds its number of bytes to the file
// size in the budget.
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
  compression_ = detect_compression({start.data(), start.size()});
  if (compression_.empty()) {
    return;
  }
  budget_ = budget_.within();
  is_file_ = false;
  try {
    reader_->unpacker.emplace(compression_,
                              [reader = reader_.get()](char* buffer, std::size_t size) {
                                return reader->read_packed(buffer, size);
                              });
  } catch (const DataError&) {
    throw;
  } catch (const Error& error) {
    throw DataError(path_, error.what());
  }
}

ByteSource::~ByteSource() = default;
ByteSource::ByteSource(ByteSource&&) noexcept = default;
ByteSource& ByteSource::operator=(ByteSource&&) noexcept = default;

// Reads in small pieces, so that a short file uses few pages of memory.
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
    return 0;  // an unpacker would loop forever
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
