// SPDX-License-Identifier: Apache-2.0
// axiscal_feed_endurance [SECONDS]: sends binary frames of 6 channels by TCP as fast as possible,
// 10,000 frames for each second of SECONDS (default 3600). Prints the number of lost samples and
// the growth of the memory.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <sys/resource.h>

#include "axiscal/acquisition/open_source.hpp"
#include "axiscal/acquisition/sample_feed.hpp"
#include "fakes.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 3600.0;
  const auto samples = static_cast<std::uint32_t>(1e4 * seconds);
  const axiscal::test::ScratchFolder folder;
  const std::string frame = folder.write(
      "frame.json",
      R"({"format": "axiscal-frames", "version": 1, "length": 20, "sync": "AA55", "fields": [
        {"name": "n", "offset": 2, "type": "uint32"}, {"name": "ax", "offset": 6, "type": "int16"},
        {"name": "ay", "offset": 8, "type": "int16"}, {"name": "az", "offset": 10, "type": "int16"},
        {"name": "gx", "offset": 12, "type": "int16"}, {"name": "gy", "offset": 14, "type": "int16"},
        {"name": "gz", "offset": 16, "type": "int16"}],
        "checksum": {"type": "crc16_ccitt", "offset": 18}})");
  const axiscal::test::FakeServer server([&](axiscal::test::Descriptor& connection, int number) {
    std::string block;
    for (std::uint32_t i = 0; i < samples && number == 0; ++i) {
      char bytes[20] = {'\xAA', '\x55'};
      std::memcpy(bytes + 2, &i, sizeof i);
      unsigned crc = 0xFFFF;
      for (int k = 0; k < 18; ++k) {
        crc ^= static_cast<unsigned>(static_cast<unsigned char>(bytes[k])) << 8U;
        for (int bit = 0; bit < 8; ++bit) {
          crc = (crc & 0x8000U) != 0 ? (crc << 1U) ^ 0x1021U : crc << 1U;
        }
      }
      bytes[18] = static_cast<char>(crc & 0xFFU);
      bytes[19] = static_cast<char>((crc >> 8U) & 0xFFU);
      block.append(bytes, sizeof bytes);
      if (block.size() > 60000) {
        connection.write(block);
        block.clear();
      }
    }
    connection.write(block);
  });
  std::vector<std::unique_ptr<axiscal::Source>> sources;
  sources.push_back(
      axiscal::open_source("tcp://127.0.0.1:" + server.port() + "?rate=10000&frame=" + frame));
  axiscal::SampleFeed feed(std::move(sources));
  axiscal::SampleBatch batch;
  double next = 0.0;
  std::size_t wrong = 0;
  long at_a_tenth = 0;
  rusage usage{};
  while (next < samples) {
    batch.clear();
    feed.read(batch, std::chrono::milliseconds(100));
    for (std::size_t i = 0; i < batch.size(); ++i, next += 1.0) {
      wrong += batch.row(i)[0] == next ? 0U : 1U;
    }
    ::getrusage(RUSAGE_SELF, &usage);
    at_a_tenth = at_a_tenth == 0 && next > samples / 10.0 ? usage.ru_maxrss : at_a_tenth;
  }
  std::printf(
      "%.0f samples of 7 channels (%.0f s at 10 kHz): %zu lost or out of place, %zu defects; "
      "memory %ld MiB at a tenth, %ld MiB at the end\n",
      next, seconds, wrong, feed.counts().defects, at_a_tenth / 1024, usage.ru_maxrss / 1024);
  return wrong == 0 ? 0 : 1;
}
