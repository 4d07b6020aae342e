// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/decoder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "acquisition/src/sample_clock.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/timestamp.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

SourceAddress address_of(const std::string& options) {
  return parse_source_address("stdin:?" + options, {"stdin"});
}

struct Decoded {
  std::vector<std::vector<double>> samples;
  int defects = 0;
};

// Feeds the bytes to the decoder in pieces of `piece` bytes.
Decoded decode(Decoder& decoder, const std::string& bytes, std::size_t piece = 7) {
  Decoded decoded;
  const DecoderSink sink{
      .sample =
          [&](std::span<const double> v) { decoded.samples.emplace_back(v.begin(), v.end()); },
      .defect = [&] { ++decoded.defects; }};
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    decoder.decode(std::string_view(bytes).substr(at, piece), sink);
  }
  return decoded;
}

TEST(Decoder, ReadsDelimitedLinesWithAHeaderAndUnits) {
  const auto decoder = make_decoder(address_of(""));
  const Decoded decoded =
      decode(*decoder, "# a logger\r\ntime;x [V];y (V)\r\n0;1,5;-2\r\n1;2;3\r\n");
  ASSERT_EQ(decoder->channels().size(), 3U);
  EXPECT_EQ(decoder->channels()[1].name, "x");
  EXPECT_EQ(decoder->channels()[1].unit, "V");
  EXPECT_EQ(decoded.samples, (std::vector<std::vector<double>>{{0, 1.5, -2}, {1, 2, 3}}));
}

TEST(Decoder, WithoutAHeaderItWantsTwoLinesThatAgree) {
  const auto decoder = make_decoder(address_of(""));
  const Decoded decoded = decode(*decoder, "0.5,3\n1,2,3\n4,5,6\n7,8\n9,10,11\n");
  EXPECT_EQ(decoded.samples, (std::vector<std::vector<double>>{{1, 2, 3}, {4, 5, 6}, {9, 10, 11}}));
  EXPECT_EQ(decoded.defects, 1);
  EXPECT_EQ(decoder->channels()[2].name, "c3");
}

TEST(Decoder, DropsAHalfLineWhereItJoinsMidway) {
  const auto decoder = make_decoder(address_of("names=x,y,z"));
  decoder->restart(true);
  // The decoder drops the first line, because it can be the end of "-12.5,2,3".
  EXPECT_EQ(decode(*decoder, "2.5,2,3\n1,2,3\n").samples,
            (std::vector<std::vector<double>>{{1, 2, 3}}));
}

TEST(Decoder, LivesThroughGarbage) {
  const auto decoder = make_decoder(address_of("names=x,y"));
  std::string noise(200000, '\xA7');
  const Decoded decoded = decode(*decoder, "1,2\n" + noise + "\n3,4\n5,\n\x01\x02\n6,7\n", 1000);
  EXPECT_EQ(decoded.samples.front(), (std::vector<double>{1, 2}));
  EXPECT_EQ(decoded.samples.back(), (std::vector<double>{6, 7}));
  EXPECT_GE(decoded.defects, 2);
}

TEST(Decoder, ReadsJsonLinesWithMembersAndLists) {
  const auto decoder = make_decoder(address_of("format=json"));
  const Decoded decoded = decode(*decoder,
                                 "{\"t\":1,\"acc\":{\"x\":2},\"gyro\":[3,4],\"id\":\"a\"}\n{\"t\":"
                                 "2,\"acc\":{\"x\":5}}\n{\"t\":\n");
  ASSERT_EQ(decoder->channels().size(), 4U);
  EXPECT_EQ(decoder->channels()[1].name, "acc.x");
  EXPECT_EQ(decoder->channels()[3].name, "gyro.1");
  ASSERT_EQ(decoded.samples.size(), 2U);
  EXPECT_EQ(decoded.samples[0], (std::vector<double>{1, 2, 3, 4}));
  EXPECT_TRUE(std::isnan(decoded.samples[1][2]));
  EXPECT_EQ(decoded.defects, 1);
}

TEST(Decoder, ReadsNamedFieldsByAPattern) {
  const auto decoder = make_decoder(address_of("pattern=X={x} Y={y}, n {} T={temperature}"));
  const Decoded decoded =
      decode(*decoder, "hello\nIMU X= +1.5 Y=-2e-1, n 77 T=20.5 ok\nX=1 Y=, n 1 T=2\n");
  EXPECT_EQ(decoded.samples, (std::vector<std::vector<double>>{{1.5, -0.2, 20.5}}));
  EXPECT_EQ(decoded.defects, 2);
}

std::string frame_of(std::int16_t x, std::int16_t y) {
  std::string frame = "\xAA\x55";
  for (const std::int16_t value : {x, y}) {
    frame += static_cast<char>(value & 0xFF);
    frame += static_cast<char>((value >> 8) & 0xFF);
  }
  unsigned sum = 0;
  for (const char c : frame) {
    sum += static_cast<unsigned char>(c);
  }
  return frame + static_cast<char>(sum & 0xFFU);
}

TEST(Decoder, ReadsBinaryFramesAndFindsThemAgainAfterABurst) {
  const test::ScratchFolder folder;
  const std::string path = folder.write("frames.json", R"({"format": "axiscal-frames", "version": 1,
    "length": 7, "sync": "AA55", "fields": [
      {"name": "x", "offset": 2, "type": "int16", "scale": 0.5, "unit": "g"},
      {"name": "y", "offset": 4, "type": "int16", "add": 1}],
    "checksum": {"type": "sum8", "offset": 6}})");
  const auto decoder = make_frame_decoder(path);
  EXPECT_EQ(decoder->channels()[0].unit, "g");
  std::string wrong = frame_of(7, 7);
  wrong[3] = 1;
  const Decoded decoded =
      decode(*decoder,
             frame_of(-4, 300) + "\xAA\x55\xAA" + wrong + frame_of(0x55AA, 0) + frame_of(2, -2), 3);
  EXPECT_EQ(decoded.samples,
            (std::vector<std::vector<double>>{{-2, 301}, {0x55AA / 2.0, 1}, {1, -1}}));
  EXPECT_EQ(decoded.defects, 1);
}

TEST(Decoder, SaysWhereAFramesDescriptionIsWrong) {
  const test::ScratchFolder folder;
  const auto complaint = [&](const std::string& rest) {
    const std::string path =
        folder.write("f.json", "{\"format\": \"axiscal-frames\", \"version\": 1, " + rest + "}");
    return test::complaint_of<DataError>([&] { static_cast<void>(make_frame_decoder(path)); });
  };
  EXPECT_NE(complaint(R"("length": 4, "sync": "A", "fields": [])").find("/sync"),
            std::string::npos);
  EXPECT_NE(complaint(R"("length": 4, "sync": "AA", "fields": [{"name": "x", "offset": 3, "type":
                      "int16"}])")
                .find("/fields/0/offset"),
            std::string::npos);
  EXPECT_NE(complaint(R"("length": 4, "sync": "AA", "fields": [{"name": "x", "offset": 1, "type":
                      "in16"}])")
                .find("did you mean 'int16'"),
            std::string::npos);
  EXPECT_NE(complaint(R"("length": 4, "fields": [{"name": "x", "offset": 1, "type": "int16"}])")
                .find("sync"),
            std::string::npos);
}

// Check values of the text "123456789" from the CRC catalogue.
TEST(Decoder, ChecksumsAgreeWithTheirPublishedCheckValues) {
  struct Case {
    const char* type;
    std::string bytes;  // little-endian
  };
  const std::vector<Case> cases = {{"crc16_ccitt", "\xB1\x29"},
                                   {"crc16_xmodem", "\xC3\x31"},
                                   {"crc16_modbus", "\x37\x4B"},
                                   {"crc32", "\x26\x39\xF4\xCB"},
                                   {"xor8", "\x31"},
                                   {"sum8", "\xDD"}};
  const test::ScratchFolder folder;
  for (const Case& one : cases) {
    const std::string path = folder.write(
        "f.json", "{\"format\": \"axiscal-frames\", \"version\": 1, \"length\": " +
                      std::to_string(9 + one.bytes.size()) +
                      ", \"fields\": [{\"name\": \"x\", \"offset\": 0, \"type\": \"uint8\"}], "
                      "\"checksum\": {\"type\": \"" +
                      one.type + "\", \"offset\": 9}}");
    const auto decoder = make_frame_decoder(path);
    EXPECT_EQ(decode(*decoder, "123456789" + one.bytes).samples,
              (std::vector<std::vector<double>>{{49}}))
        << one.type;
  }
}

TEST(SampleClock, LeavesOutJumpsAndWhatComesTwice) {
  SampleClock clock(address_of("time=t"));
  clock.set_channels({{"t", ""}, {"x", ""}});
  SampleBatch batch;
  SourceReport report;
  const auto add = [&](double t, double x, double arrival) {
    const std::vector<double> row = {t, x};
    clock.append(row, arrival, batch, report);
  };
  add(100.0, 1, 5.0);
  add(100.1, 2, 5.1);
  add(100.1, 2, 5.1);
  EXPECT_EQ(report.duplicates, 1U);
  add(7300.2, 3, 5.2);  // the device clock was set forward
  EXPECT_TRUE(report.clock_stepped);
  add(7300.3, 4, 5.3);
  add(50.0, 5, 5.4);  // the device clock was set back
  add(50.1, 6, 5.5);
  ASSERT_EQ(batch.size(), 6U);
  for (std::size_t i = 0; i < batch.size(); ++i) {
    EXPECT_NEAR(batch.time_s[i], 5.0 + 0.1 * static_cast<double>(i), 1e-6);
  }
}

// The stated rate is 100 Hz and the real rate is 101 Hz. Samples arrive in groups of ten, and one
// group in 50 arrives 0.09 s late. There is one interruption of 30 s.
TEST(SampleClock, CountsByTheStatedRateAndStaysWithTheArrivals) {
  SampleClock clock(address_of("rate=100"));
  SampleBatch batch;
  SourceReport report;
  const std::vector<double> row = {1.0};
  double arrival = 0.0;
  int n = 0;
  const auto run = [&](double seconds, double rate_hz) {
    for (const double until = arrival + seconds; arrival < until; ++n) {
      arrival += n % 10 == 0 ? 10.0 / rate_hz : 0.0;
      clock.append(row, arrival + (n / 10 % 50 == 7 ? 0.09 : 0.0), batch, report);
    }
  };
  arrival = 3.0;
  run(20.0, 100.0);
  for (std::size_t i = 1; i < batch.size(); ++i) {
    ASSERT_NEAR(batch.time_s[i] - batch.time_s[i - 1], 0.01, 1e-12) << "as stated, it is counted";
  }
  run(600.0, 101.0);
  EXPECT_NEAR(batch.time_s.back(), arrival, 0.5);
  const std::size_t before = batch.size();
  arrival += 30.0;  // an interruption of 30 s
  run(10.0, 101.0);
  EXPECT_NEAR(batch.time_s[before], batch.time_s[before - 1] + 30.0, 0.5);
  for (std::size_t i = before + 1; i < batch.size(); ++i) {
    ASSERT_NEAR(batch.time_s[i] - batch.time_s[i - 1], 0.01, 0.001) << i - before;
  }
  EXPECT_NEAR(batch.time_s.back(), arrival, 0.5);
  const std::size_t much_slower = batch.size();
  run(100.0, 80.0);
  for (std::size_t i = much_slower; i < batch.size(); ++i) {
    ASSERT_LT(batch.time_s[i] - batch.time_s[i - 1], 0.02) << "no jumps";
  }
  EXPECT_NEAR(batch.time_s.back(), arrival, 0.6);
  EXPECT_TRUE(std::is_sorted(batch.time_s.begin(), batch.time_s.end()));
  EXPECT_NEAR(report.time_at_zero.value(), seconds_now() - session_seconds(), 1.0);
}

TEST(SampleClock, OfARecordingTellsWhenItBegan) {
  for (const double start : {1782028800.0, 12.0}) {
    SampleClock clock(address_of("time=t"));
    clock.set_channels({{"t", ""}});
    SampleBatch batch;
    SourceReport report;
    clock.append(std::vector<double>{start}, 0.0, batch, report);
    EXPECT_EQ(report.time_at_zero, start);
    EXPECT_EQ(batch.time_s.front(), 0.0);
  }
}

}  // namespace
}  // namespace axiscal
