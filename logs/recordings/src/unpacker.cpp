// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/unpacker.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <new>
#include <span>
#include <utility>
#include <vector>

#ifdef AXISCAL_ZLIB
#include <zlib.h>
#endif
#ifdef AXISCAL_BZ2
#include <bzlib.h>
#endif
#ifdef AXISCAL_LZMA
#include <lzma.h>
#endif
#ifdef AXISCAL_LZ4
#include <lz4frame.h>
#endif
#ifdef AXISCAL_ZSTD
#include <zstd.h>
#endif

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/byte_source.hpp"

namespace axiscal {
namespace {

constexpr std::size_t piece = 1U << 16U;
constexpr std::size_t most_at_once = 1U << 30U;  // some libraries use 32-bit sizes

// Base class of the decoders of compressed streams; each compression library has its own decoder.
class Decoder {
 public:
  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  virtual ~Decoder() = default;

  // Prepares the decoder for another stream.
  virtual void restart() = 0;

  // Unpacks bytes of `in` into `out`. Then removes the consumed bytes from the front of `in`, and
  // the filled bytes from the front of `out`.
  // @return true at the end of the stream.
  // @throws DamagedStream
  virtual bool step(std::string_view& in, std::span<char>& out) = 0;
};

// Passes `in` and `out` to a library whose streams have the members next_in, avail_in, next_out and
// avail_out, calls `run`, and removes the bytes that were consumed and filled.
template <typename Stream, typename Run>
auto run_stream(Stream& stream, std::string_view& in, std::span<char>& out, const Run& run) {
  using Byte = std::remove_pointer_t<decltype(stream.next_out)>;
  using Count = decltype(stream.avail_in);
  stream.next_in = reinterpret_cast<Byte*>(const_cast<char*>(in.data()));
  stream.avail_in = static_cast<Count>(in.size());
  stream.next_out = reinterpret_cast<Byte*>(out.data());
  stream.avail_out = static_cast<Count>(out.size());
  const auto status = run();
  in.remove_prefix(in.size() - stream.avail_in);
  out = out.last(stream.avail_out);
  return status;
}

#ifdef AXISCAL_ZLIB
class ZlibDecoder final : public Decoder {
 public:
  explicit ZlibDecoder(int window_bits) { inflateInit2(&stream_, window_bits); }
  ~ZlibDecoder() override { inflateEnd(&stream_); }
  void restart() override { inflateReset(&stream_); }

  bool step(std::string_view& in, std::span<char>& out) override {
    const int status = run_stream(stream_, in, out, [&] { return inflate(&stream_, Z_NO_FLUSH); });
    if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR) {
      throw DamagedStream(stream_.msg != nullptr ? stream_.msg : "bad data");
    }
    return status == Z_STREAM_END;
  }

 private:
  z_stream stream_{};
};
#endif

#ifdef AXISCAL_BZ2
class Bzip2Decoder final : public Decoder {
 public:
  Bzip2Decoder() { BZ2_bzDecompressInit(&stream_, 0, 0); }
  ~Bzip2Decoder() override { BZ2_bzDecompressEnd(&stream_); }
  void restart() override {
    BZ2_bzDecompressEnd(&stream_);
    stream_ = {};
    BZ2_bzDecompressInit(&stream_, 0, 0);
  }

  bool step(std::string_view& in, std::span<char>& out) override {
    const int status = run_stream(stream_, in, out, [&] { return BZ2_bzDecompress(&stream_); });
    if (status != BZ_OK && status != BZ_STREAM_END) {
      throw DamagedStream("bad data");
    }
    return status == BZ_STREAM_END;
  }

 private:
  bz_stream stream_{};
};
#endif

#ifdef AXISCAL_LZMA
// Decodes xz; with liblzma 5.4 or later, also lzip.
class LzmaDecoder final : public Decoder {
 public:
  LzmaDecoder() { LzmaDecoder::restart(); }
  ~LzmaDecoder() override { lzma_end(&stream_); }
  void restart() override {
    constexpr std::uint64_t most_memory = std::uint64_t{256} << 20U;  // `xz -9` needs 65 MiB
    if (lzma_auto_decoder(&stream_, most_memory, 0) != LZMA_OK) {
      throw std::bad_alloc();
    }
  }

  bool step(std::string_view& in, std::span<char>& out) override {
    const lzma_ret status =
        run_stream(stream_, in, out, [&] { return lzma_code(&stream_, LZMA_RUN); });
    if (status == LZMA_MEMLIMIT_ERROR) {
      throw DamagedStream("unpacking requires more than 256 MiB of memory");
    }
    if (status != LZMA_OK && status != LZMA_STREAM_END && status != LZMA_BUF_ERROR) {
      throw DamagedStream("bad data");
    }
    return status == LZMA_STREAM_END;
  }

 private:
  lzma_stream stream_ = LZMA_STREAM_INIT;
};
#endif

#ifdef AXISCAL_ZSTD
class ZstdDecoder final : public Decoder {
 public:
  void restart() override { ZSTD_DCtx_reset(context_.get(), ZSTD_reset_session_only); }

  bool step(std::string_view& in, std::span<char>& out) override {
    ZSTD_inBuffer packed{in.data(), in.size(), 0};
    ZSTD_outBuffer content{out.data(), out.size(), 0};
    const std::size_t status = ZSTD_decompressStream(context_.get(), &content, &packed);
    if (ZSTD_isError(status) != 0U) {
      throw DamagedStream(ZSTD_getErrorName(status));
    }
    in.remove_prefix(packed.pos);
    out = out.subspan(content.pos);
    return status == 0;
  }

 private:
  std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context_{ZSTD_createDCtx(),
                                                                   ZSTD_freeDCtx};
};
#endif

#ifdef AXISCAL_LZ4
class Lz4Decoder final : public Decoder {
 public:
  Lz4Decoder() { LZ4F_createDecompressionContext(&context_, LZ4F_VERSION); }
  ~Lz4Decoder() override { LZ4F_freeDecompressionContext(context_); }
  void restart() override { LZ4F_resetDecompressionContext(context_); }

  bool step(std::string_view& in, std::span<char>& out) override {
    std::size_t taken = in.size();
    std::size_t made = out.size();
    const std::size_t status =
        LZ4F_decompress(context_, out.data(), &made, in.data(), &taken, nullptr);
    if (LZ4F_isError(status) != 0U) {
      throw DamagedStream(LZ4F_getErrorName(status));
    }
    in.remove_prefix(taken);
    out = out.subspan(made);
    return status == 0;
  }

 private:
  LZ4F_dctx* context_ = nullptr;
};
#endif

// @return a decoder for the compression `packing`; null if this build lacks the library for it.
std::unique_ptr<Decoder> decoder_of([[maybe_unused]] std::string_view packing) {
#ifdef AXISCAL_ZLIB
  if (packing == "gzip" || packing == "zlib") {
    constexpr int largest_window = 15;
    constexpr int of_gzip = 16;
    return std::make_unique<ZlibDecoder>(largest_window + (packing == "gzip" ? of_gzip : 0));
  }
#endif
#ifdef AXISCAL_BZ2
  if (packing == "bzip2") {
    return std::make_unique<Bzip2Decoder>();
  }
#endif
#ifdef AXISCAL_LZMA
  constexpr std::uint32_t first_with_lzip = 50040002;
  if (packing == "xz" || (packing == "lzip" && lzma_version_number() >= first_with_lzip)) {
    return std::make_unique<LzmaDecoder>();
  }
#endif
#ifdef AXISCAL_ZSTD
  if (packing == "zstd") {
    return std::make_unique<ZstdDecoder>();
  }
#endif
#ifdef AXISCAL_LZ4
  if (packing == "lz4") {
    return std::make_unique<Lz4Decoder>();
  }
#endif
  return nullptr;
}

}  // namespace

struct Unpacker::State {
  std::unique_ptr<Decoder> decoder;
  Read packed;
  std::vector<char> buffer = std::vector<char>(piece);
  std::string_view in;       // bytes of `buffer` that have not been unpacked yet
  bool in_stream = true;     // true if a stream has begun but not ended
  bool at_file_end = false;  // true at the end of the packed bytes

  // Reads packed bytes if `in` is empty.
  void refill() {
    if (in.empty() && !at_file_end) {
      in = {buffer.data(), packed(buffer.data(), buffer.size())};
      at_file_end = in.empty();
    }
  }

  // @return false at the end of the content.
  bool step(std::span<char>& out) {
    refill();
    if (!in_stream) {
      if (in.empty()) {
        return false;
      }
      decoder->restart();
      in_stream = true;
    }
    const std::size_t had_in = in.size();
    const std::size_t had_out = out.size();
    in_stream = !decoder->step(in, out);
    if (in_stream && in.size() == had_in && out.size() == had_out) {
      throw DamagedStream(had_in == 0 ? "the end is missing" : "bad data");
    }
    return true;
  }
};

Unpacker::Unpacker(std::string_view packing, Read packed) : state_(std::make_unique<State>()) {
  state_->decoder = decoder_of(packing);
  state_->packed = std::move(packed);
  if (state_->decoder == nullptr) {
    throw Error(formatted(
        "is compressed ({}), but this build of axiscal cannot unpack this format; unpack the file "
        "first",
        packing));
  }
}

Unpacker::~Unpacker() = default;
Unpacker::Unpacker(Unpacker&&) noexcept = default;
Unpacker& Unpacker::operator=(Unpacker&&) noexcept = default;

std::size_t Unpacker::read(char* buffer, std::size_t size) {
  const std::size_t wanted = std::min(size, most_at_once);
  std::span<char> out(buffer, wanted);
  while (out.size() == wanted && wanted > 0 && state_->step(out)) {
  }
  return wanted - out.size();
}

std::string_view detect_compression(std::string_view start) {
  using namespace std::string_view_literals;
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> known = {
      {{"\x1f\x8b"sv, "gzip"sv},
       {"BZh"sv, "bzip2"sv},
       {"\xfd"
        "7zXZ\0"sv,
        "xz"sv},
       {"\x28\xb5\x2f\xfd"sv, "zstd"sv},
       {"\x04\x22\x4d\x18"sv, "lz4"sv},
       {"\x1f\x9d"sv, "compress"sv},
       {"LZIP"sv, "lzip"sv}}};
  for (const auto& [magic, name] : known) {
    if (start.starts_with(magic)) {
      return name;
    }
  }
  return {};
}

std::optional<std::string> unpack(std::string_view packing,
                                  std::string_view block,
                                  std::size_t size,
                                  const ReadBudget& budget) {
  budget.check(ReadCost::memory, static_cast<double>(size));
  budget.spend(ReadCost::unpacked, size);
  Unpacker unpacker(packing, [&block](char* buffer, std::size_t most) {
    const std::size_t count = block.copy(buffer, most);
    block.remove_prefix(count);
    return count;
  });
  try {
    std::string content = read_up_to(
        size, [&unpacker](char* buffer, std::size_t most) { return unpacker.read(buffer, most); });
    if (content.size() == size) {
      return content;
    }
  } catch (const DamagedStream&) {
    return std::nullopt;
  }
  return std::nullopt;
}

std::optional<std::string> unpack_zstd([[maybe_unused]] std::string_view block,
                                       [[maybe_unused]] const ReadBudget& budget) {
#ifdef AXISCAL_ZSTD
  const unsigned long long size = ZSTD_getFrameContentSize(block.data(), block.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) {
    return std::nullopt;
  }
  return unpack("zstd", block, static_cast<std::size_t>(size), budget);
#else
  throw Error(
      "is packed with zstd, but this axiscal was built without libzstd; unpack the file first");
#endif
}

}  // namespace axiscal
