// SPDX-License-Identifier: Apache-2.0
#include "structured.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <random>
#include <zlib.h>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace axiscal::fuzz {
namespace {

using namespace std::string_literals;
using namespace std::string_view_literals;

template <typename Number>
Number number_at(std::string_view bytes, std::size_t at) {
  Number value{};
  if (at + sizeof value <= bytes.size()) {
    std::memcpy(&value, bytes.data() + at, sizeof value);
  }
  return value;
}

template <typename Number>
void put_number(std::string& bytes, Number value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Parses records of a head and a payload. The length of the payload is stored next to the head.
template <typename Length>
void parse_records(std::string_view bytes,
                   std::size_t at,
                   std::size_t head_at,
                   std::size_t head_size,
                   std::size_t length_at,
                   RecordFile& file) {
  const std::size_t size = head_size + sizeof(Length);
  while (at + size <= bytes.size()) {
    const auto length = static_cast<std::size_t>(number_at<Length>(bytes, at + length_at));
    const std::size_t left = bytes.size() - at - size;
    file.heads.emplace_back(bytes.substr(at + head_at, head_size));
    file.payloads.emplace_back(bytes.substr(at + size, std::min(length, left)));
    at += size + std::min(length, left);
  }
}

constexpr std::size_t ulog_header = 16;

RecordFile parse_ulog(std::string_view bytes) {
  RecordFile file{.start = std::string(bytes.substr(0, ulog_header)), .payloads = {}, .heads = {}};
  parse_records<std::uint16_t>(bytes, file.start.size(), 2, 1, 0, file);
  return file;
}

std::string join_ulog(const RecordFile& file) {
  std::string bytes = file.start;
  for (std::size_t i = 0; i < file.payloads.size(); ++i) {
    const std::string payload = file.payloads[i].substr(0, 65535);
    put_number(bytes, static_cast<std::uint16_t>(payload.size()));
    bytes += file.heads[i] + payload;
  }
  return bytes;
}

constexpr std::string_view mcap_magic = "\x89MCAP0\r\n"sv;

RecordFile parse_mcap(std::string_view bytes) {
  RecordFile file{.start = std::string(mcap_magic), .payloads = {}, .heads = {}};
  parse_records<std::uint64_t>(bytes, std::min(mcap_magic.size(), bytes.size()), 0, 1, 1, file);
  return file;
}

std::string join_mcap(const RecordFile& file) {
  std::string bytes = file.start;
  for (std::size_t i = 0; i < file.payloads.size(); ++i) {
    bytes += file.heads[i];
    put_number(bytes, static_cast<std::uint64_t>(file.payloads[i].size()));
    bytes += file.payloads[i];
  }
  return bytes;
}

constexpr std::string_view bag_magic = "#ROSBAG V2.0\n"sv;

// A record of a bag is a header and data, each with its length, in this order.
RecordFile parse_bag(std::string_view bytes) {
  RecordFile file{.start = std::string(bag_magic), .payloads = {}, .heads = {}};
  parse_records<std::uint32_t>(bytes, std::min(bag_magic.size(), bytes.size()), 0, 0, 0, file);
  return file;
}

std::string join_bag(const RecordFile& file) {
  std::string bytes = file.start;
  for (const std::string& payload : file.payloads) {
    put_number(bytes, static_cast<std::uint32_t>(payload.size()));
    bytes += payload;
  }
  return bytes;
}

std::string inflated(std::string_view packed) {
  z_stream stream{};
  inflateInit2(&stream, -15);
  std::string out(1U << 18U, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  inflate(&stream, Z_FINISH);
  out.resize(out.size() - stream.avail_out);
  inflateEnd(&stream);
  return out;
}

// The unpacked members of an archive, found by their local headers.
RecordFile parse_zip(std::string_view bytes) {
  RecordFile file;
  constexpr std::size_t header = 30;
  for (std::size_t at = bytes.find("PK\x03\x04"sv);
       at != std::string_view::npos && at + header <= bytes.size();
       at = bytes.find("PK\x03\x04"sv, at + 4)) {
    const auto method = number_at<std::uint16_t>(bytes, at + 8);
    std::size_t packed = number_at<std::uint32_t>(bytes, at + 18);
    const std::size_t name = number_at<std::uint16_t>(bytes, at + 26);
    const std::size_t extra = number_at<std::uint16_t>(bytes, at + 28);
    const std::size_t data = std::min(bytes.size(), at + header + name + extra);
    if (packed == 0) {  // the size is stored after the data
      packed = std::min(bytes.find("PK"sv, data), bytes.size()) - data;
    }
    const std::string_view content = bytes.substr(data, packed);
    file.heads.emplace_back(bytes.substr(std::min(bytes.size(), at + header), name));
    file.payloads.push_back(method == 8 ? inflated(content) : std::string(content));
  }
  return file;
}

std::string join_zip(const RecordFile& file) {
  std::string bytes, directory;
  for (std::size_t i = 0; i < file.payloads.size(); ++i) {
    const std::string& payload = file.payloads[i];
    std::string common;
    put_number<std::uint16_t>(common, 20);
    put_number<std::uint32_t>(common, 0);  // flags 0, method stored
    put_number<std::uint32_t>(common, 0);  // time
    put_number(common,
               static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(payload.data()),
                                                static_cast<uInt>(payload.size()))));
    put_number(common, static_cast<std::uint32_t>(payload.size()));
    put_number(common, static_cast<std::uint32_t>(payload.size()));
    put_number(common, static_cast<std::uint16_t>(file.heads[i].size()));
    put_number<std::uint16_t>(common, 0);
    const auto offset = static_cast<std::uint32_t>(bytes.size());
    bytes += "PK\x03\x04"s + common + file.heads[i] + payload;
    directory += "PK\x01\x02"s;
    put_number<std::uint16_t>(directory, 20);
    directory += common + std::string(10, '\0');
    put_number(directory, offset);
    directory += file.heads[i];
  }
  const auto offset = static_cast<std::uint32_t>(bytes.size());
  bytes += directory + "PK\x05\x06"s + std::string(4, '\0');
  put_number(bytes, static_cast<std::uint16_t>(file.payloads.size()));
  put_number(bytes, static_cast<std::uint16_t>(file.payloads.size()));
  put_number(bytes, static_cast<std::uint32_t>(directory.size()));
  put_number(bytes, offset);
  put_number<std::uint16_t>(bytes, 0);
  return bytes;
}

constexpr std::array formats = {
    RecordFormat{"ulog", parse_ulog, join_ulog}, RecordFormat{"mcap", parse_mcap, join_mcap},
    RecordFormat{"rosbag1", parse_bag, join_bag}, RecordFormat{"zip", parse_zip, join_zip}};

void change_one(RecordFile& file, std::mt19937& random, std::size_t room) {
  const std::size_t i = random() % file.payloads.size();
  switch (random() % 8) {
    case 0:
      file.payloads.insert(file.payloads.begin() + static_cast<std::ptrdiff_t>(i),
                           file.payloads[i]);
      if (!file.heads.empty()) {
        file.heads.insert(file.heads.begin() + static_cast<std::ptrdiff_t>(i), file.heads[i]);
      }
      return;
    case 1:
      file.payloads.erase(file.payloads.begin() + static_cast<std::ptrdiff_t>(i));
      if (!file.heads.empty()) {
        file.heads.erase(file.heads.begin() + static_cast<std::ptrdiff_t>(i));
      }
      return;
    case 2:
      std::swap(file.payloads[i], file.payloads[random() % file.payloads.size()]);
      return;
    default: {
      std::string& payload = file.payloads[i];
      const std::size_t size = payload.size();
      payload.resize(size + std::min<std::size_t>(room, 256));
      payload.resize(
          LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(payload.data()), size, payload.size()));
    }
  }
}

}  // namespace

const RecordFormat* format_of_target(std::string_view target) {
  const auto* const found = std::find_if(
      formats.begin(), formats.end(), [&](const auto& format) { return format.target == target; });
  return found == formats.end() ? nullptr : found;
}

std::size_t mutate_records(const RecordFormat& format,
                           unsigned char* data,
                           std::size_t size,
                           std::size_t max_size,
                           unsigned seed) {
  std::mt19937 random(seed);
  RecordFile file = format.parse({reinterpret_cast<const char*>(data), size});
  if (file.payloads.empty() || random() % 8 == 0) {
    return LLVMFuzzerMutate(data, size, max_size);
  }
  change_one(file, random, max_size > size ? max_size - size : 0);
  const std::string bytes = format.join(file);
  if (bytes.size() > max_size) {
    return LLVMFuzzerMutate(data, size, max_size);
  }
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}

}  // namespace axiscal::fuzz
