// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/unpack.hpp"

#include <algorithm>

#ifdef AXISCAL_BZ2
#include <bzlib.h>
#endif
#ifdef AXISCAL_LZ4
#include <lz4frame.h>
#endif
#ifdef AXISCAL_ZSTD
#include <zstd.h>
#endif

#include "axiscal/core/error.hpp"

namespace axiscal {
namespace {

constexpr std::size_t piece = 1U << 20U;

// Memory grows with what comes out, not with what the file states: `more` is given room and
// returns how many bytes it wrote, 0 at the end, nothing for damage.
template <typename More>
std::optional<std::string> grow(std::size_t size, const More& more) {
  std::string out;
  std::size_t filled = 0;
  while (filled < size) {
    out.resize(std::min(size, std::max(2 * filled, piece)));
    const std::optional<std::size_t> count = more(out.data() + filled, out.size() - filled);
    if (!count) {
      return std::nullopt;
    }
    filled += *count;
    if (*count == 0) {
      break;
    }
  }
  out.resize(filled);
  return filled == size ? std::optional(std::move(out)) : std::nullopt;
}

#ifdef AXISCAL_BZ2
std::optional<std::string> unpack_bz2(std::string_view block, std::size_t size) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) {
    return std::nullopt;
  }
  std::string input(block);
  stream.next_in = input.data();
  stream.avail_in = static_cast<unsigned>(input.size());
  bool ended = false;
  auto out = grow(size, [&](char* to, std::size_t room) -> std::optional<std::size_t> {
    stream.next_out = to;
    stream.avail_out = static_cast<unsigned>(room);
    while (stream.avail_out > 0 && !ended) {
      const unsigned before_in = stream.avail_in;
      const unsigned before_out = stream.avail_out;
      const int status = BZ2_bzDecompress(&stream);
      ended = status == BZ_STREAM_END;
      if (status != BZ_OK && status != BZ_STREAM_END) {
        return std::nullopt;
      }
      if (!ended && before_in == stream.avail_in && before_out == stream.avail_out) {
        break;
      }
    }
    return room - stream.avail_out;
  });
  BZ2_bzDecompressEnd(&stream);
  return out;
}
#endif

#ifdef AXISCAL_LZ4
std::optional<std::string> unpack_lz4(std::string_view block, std::size_t size) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0U) {
    return std::nullopt;
  }
  auto out = grow(size, [&](char* to, std::size_t room) -> std::optional<std::size_t> {
    std::size_t written = 0;
    while (written < room && !block.empty()) {
      std::size_t out_size = room - written;
      std::size_t in_size = block.size();
      const std::size_t status =
          LZ4F_decompress(context, to + written, &out_size, block.data(), &in_size, nullptr);
      if (LZ4F_isError(status) != 0U) {
        return std::nullopt;
      }
      block.remove_prefix(in_size);
      written += out_size;
      if (in_size == 0 && out_size == 0) {
        break;
      }
    }
    return written;
  });
  LZ4F_freeDecompressionContext(context);
  return out;
}
#endif

#ifdef AXISCAL_ZSTD
std::optional<std::string> unpack_zstd_to(std::string_view block, std::size_t size) {
  ZSTD_DStream* stream = ZSTD_createDStream();
  ZSTD_inBuffer in{block.data(), block.size(), 0};
  auto out = grow(size, [&](char* to, std::size_t room) -> std::optional<std::size_t> {
    ZSTD_outBuffer buffer{to, room, 0};
    while (buffer.pos < buffer.size) {
      const std::size_t before_in = in.pos;
      const std::size_t before_out = buffer.pos;
      if (ZSTD_isError(ZSTD_decompressStream(stream, &buffer, &in)) != 0U) {
        return std::nullopt;
      }
      if (before_in == in.pos && before_out == buffer.pos) {
        break;
      }
    }
    return buffer.pos;
  });
  ZSTD_freeDStream(stream);
  return out;
}
#endif

[[noreturn]] [[maybe_unused]] void cannot(std::string_view packing, const char* library) {
  throw Error("is packed with " + std::string(packing) + ", and this axiscal was built without " +
              library);
}

}  // namespace

std::optional<std::string> unpack(std::string_view packing,
                                  [[maybe_unused]] std::string_view block,
                                  std::size_t size,
                                  const ReadBudget& budget) {
  budget.check(ReadCost::memory, static_cast<double>(size));
  budget.spend(ReadCost::unpacked, size);
  if (packing == "bz2") {
#ifdef AXISCAL_BZ2
    return unpack_bz2(block, size);
#else
    cannot(packing, "libbz2");
#endif
  }
  if (packing == "lz4") {
#ifdef AXISCAL_LZ4
    return unpack_lz4(block, size);
#else
    cannot(packing, "liblz4");
#endif
  }
  if (packing == "zstd") {
#ifdef AXISCAL_ZSTD
    return unpack_zstd_to(block, size);
#else
    cannot(packing, "libzstd");
#endif
  }
  throw Error("is packed with '" + std::string(packing) + "', which is not known");
}

std::optional<std::string> unpack_zstd(std::string_view block, const ReadBudget& budget) {
#ifdef AXISCAL_ZSTD
  const unsigned long long size = ZSTD_getFrameContentSize(block.data(), block.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) {
    return std::nullopt;
  }
  return unpack("zstd", block, static_cast<std::size_t>(size), budget);
#else
  static_cast<void>(block);
  static_cast<void>(budget);
  cannot("zstd", "libzstd");
#endif
}

}  // namespace axiscal
