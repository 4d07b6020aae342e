// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/log_file.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>

#include <gmock/gmock.h>

#ifdef AXISCAL_LIBARCHIVE
#include <archive.h>
#include <archive_entry.h>
#endif
#ifdef AXISCAL_MATIO
#include <matio.h>
#endif

#include "allocations.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "data.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class LogFiles : public testing::Test {
 protected:
  LogBlock read(const std::string& text, const LogFormat& format = {}) {
    LogFile log(folder_.write("log.csv", text), format);
    LogBlock all = read_log(log);
    columns_ = log.columns();
    notes_ = log.notes();
    defects_ = log.defects();
    return all;
  }

  std::string complaint(const std::string& bytes) {
    return test::complaint_of<DataError>([&] { read(bytes); });
  }

  test::ScratchFolder folder_;
  std::vector<std::string> columns_;
  std::vector<std::string> notes_;
  LogDefects defects_;
};

TEST_F(LogFiles, AreReadWhateverPartsTheirCells) {
  const std::vector<std::pair<const char*, const char*>> texts = {
      {"comma", "t,x,y\n0,1.5,-2\n1,2.5,-3e1\n"},
      {"semicolon", "t;x;y\n0;1.5;-2\n1;2.5;-3e1\n"},
      {"decimal comma", "t;x;y\n0;1,5;-2\n1;2,5;-30,0\n"},
      {"tab", "t\tx\ty\n0\t1.5\t-2\n1\t2.5\t-3e1\n"},
      {"tab and decimal comma", "t\tx\ty\n0\t1,5\t-2\n1\t2,5\t-30\n"},
      {"blanks", "  t   x    y\n  0  1.5  -2\n  1  2.5  -3e1\n"},
      {"carriage returns, quotes", "\"t\",\"x\",\"y\"\r\n0, 1.5 ,-2\r\n1,\"2.5\",-3e1\r\n"},
      {"preamble", "Fs,100\nby hand,2026\n\nt,x,y\n0,1.5,-2\n1,2.5,-3e1\n"},
      {"checksums", "t,x,y*3F\n0,1.5,-2*68\r\n1,2.5,-3e1*0a\n"},
      {"comments", "# of today\n% more\nt,x,y\n0,1.5,-2\n# in between\n1,2.5,-3e1"},
      {"byte order mark", "\xEF\xBB\xBFt,x,y\n0,1.5,-2\n1,2.5,-3e1\n"}};
  for (const auto& [name, text] : texts) {
    const LogBlock all = read(text);
    EXPECT_THAT(columns_, ElementsAre("t", "x", "y")) << name;
    ASSERT_EQ(all.size(), 3U) << name;
    EXPECT_THAT(all[0], ElementsAre(0.0, 1.0)) << name;
    EXPECT_THAT(all[1], ElementsAre(1.5, 2.5)) << name;
    EXPECT_THAT(all[2], ElementsAre(-2.0, -30.0)) << name;
    EXPECT_EQ(defects_.ragged_rows, 0U) << name;
  }
}

TEST_F(LogFiles, WithoutAHeaderTakeNamesOrNumbers) {
  EXPECT_THAT(read("1 2 3\n4 5 6\n"),
              ElementsAre(ElementsAre(1, 4), ElementsAre(2, 5), ElementsAre(3, 6)));
  EXPECT_THAT(columns_, ElementsAre("c1", "c2", "c3"));
  EXPECT_THAT(notes_, testing::Contains(HasSubstr("has no header")));
  read("1 2 3\n4 5 6\n", {.names = {"a", "b", "c"}});
  EXPECT_THAT(columns_, ElementsAre("a", "b", "c"));
  EXPECT_THAT(test::complaint_of<DataError>([&] {
                read("1 2 3\n", {.names = {"a", "b"}});
              }),
              HasSubstr("2 column names are given, but the file has 3 columns"));
}

TEST_F(LogFiles, RenameScaleAndTurnColumnsRound) {
  const std::string map = folder_.write(
      "map.json",
      R"({"format":"axiscal-log","version":1,"columns":{"x":"acc_1","y":{"column":"acc_2","factor":-9.81}}})");
  const LogBlock all = read("acc_1,acc_2\n1,2\n3,4\n", read_log_format(map));
  EXPECT_THAT(columns_, ElementsAre("x", "y"));
  EXPECT_THAT(all[1], ElementsAre(-19.62, -39.24));
  EXPECT_THAT(test::complaint_of<DataError>([&] { read("a,b\n1,2\n", read_log_format(map)); }),
              HasSubstr("column 'acc_1' is missing. The columns are: a, b"));
  EXPECT_THAT(
      test::complaint_of<DataError>([&] {
        static_cast<void>(read_log_format(folder_.write(
            "bad.json",
            R"({"format":"axiscal-log","version":1,"columns":{"x":{"column":"a","factor":0}}})")));
      }),
      HasSubstr("/columns/x: factor must not be 0"));
}

TEST_F(LogFiles, GiveTheChosenColumnsBlockByBlock) {
  std::string text = "a,b,c\n";
  for (int i = 0; i < 5000; ++i) {
    text += std::to_string(i) + "," + std::to_string(2 * i) + "," + std::to_string(3 * i) + "\n";
  }
  LogFile log(folder_.write("long.csv", text));
  log.select({2, 0});
  LogBlock block;
  std::size_t rows = 0;
  while (const std::size_t count = log.read(block, 777)) {
    ASSERT_EQ(block.size(), 2U);
    for (std::size_t i = 0; i < count; ++i, ++rows) {
      ASSERT_EQ(block[0][i], 3.0 * static_cast<double>(rows));
      ASSERT_EQ(block[1][i], static_cast<double>(rows));
    }
  }
  EXPECT_EQ(rows, 5000U);
}

// Found by a fuzzer: a line of 28,764 cells made the reader allocate 4,096 such rows, 942 MB.
TEST_F(LogFiles, OfVeryWideLinesTakeNoMoreMemoryThanTheirBlock) {
  std::string text;
  for (int row = 0; row < 150; ++row) {
    for (int cell = 0; cell < 15000; ++cell) {
      text += cell > 0 ? ",1" : "1";
    }
    text += '\n';
  }
  LogFile log(folder_.write("wide.csv", text));
  LogBlock block;
  std::size_t rows = 0;
  while (const std::size_t count = log.read(block, 16384)) {
    EXPECT_LT(block.size() * block.front().capacity(), std::size_t{2} << 20U);
    rows += count;
  }
  EXPECT_EQ(rows, 150U);
}

TEST_F(LogFiles, CountWhatIsBroken) {
  const LogBlock all = read("t,x\n0,1\n1,nan\n2\n3,4\n4,1e999\n5,6,7\n6,\n7,8");
  EXPECT_THAT(all[0], ElementsAre(0, 1, 3, 4, 6, 7));
  EXPECT_TRUE(std::isnan(all[1][1]) && std::isnan(all[1][3]) && std::isnan(all[1][4]));
  EXPECT_EQ(defects_.ragged_rows, 2U);
  EXPECT_EQ(defects_.first_ragged_line, 4U);
  EXPECT_EQ(defects_.missing_numbers, 3U);
  EXPECT_EQ(defects_.first_missing_line, 3U);
}

// Numbers in all notations are read exactly.
TEST_F(LogFiles, ReadNumbersExactly) {
  const std::vector<std::pair<const char*, double>> numbers = {
      {"0", 0.0},
      {"-0.0", -0.0},
      {"5.", 5.0},
      {".5", 0.5},
      {"-.25", -0.25},
      {"0.1", 0.1},
      {"123456789.123456789", 123456789.123456789},
      {"9007199254740993", 9007199254740993.0},
      {"0.30000000000000004", 0.30000000000000004},
      {"1e-7", 1e-7},
      {"2.5E+3", 2500.0},
      {"12345678901234567890123", 12345678901234567890123.0},
      {"0.00000000000000000000000012345", 1.2345e-25},
      {"-32768", -32768.0},
      {"+7", 7.0},
      {"1.7976931348623157e308", 1.7976931348623157e308}};
  std::string text = "t,x\n";
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    text += std::to_string(i) + "," + numbers[i].first + "\n";
  }
  const LogBlock all = read(text);
  ASSERT_EQ(all[1].size(), numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    EXPECT_EQ(all[1][i], numbers[i].second) << numbers[i].first;
  }
  EXPECT_THAT(read("t,u,x\n0,0,.\n1,0,-\n2,0,1.5.2\n3,0,1e\n4,0,inf\n")[2],
              testing::Each(testing::IsNan()));
}

TEST_F(LogFiles, SayWhyTheyCannotBeRead) {
  EXPECT_THAT(complaint(""), HasSubstr("the file is empty"));
  EXPECT_THAT(complaint("only words\nand more\n"), HasSubstr(":1: there is no row of numbers"));
  EXPECT_THAT(complaint("x,x\n1,2\n"),
              HasSubstr(":1: column 'x': the header contains this name twice"));
  EXPECT_THAT(complaint(std::string("\xFF\xFE\x77\0\x0A\0", 6)),
              HasSubstr(":1: there is no row of numbers"));  // UTF-16
  EXPECT_THAT(complaint(std::string("\x7f"
                                    "ELF\0\0\0\0",
                                    8)),
              HasSubstr("is neither text"));
  EXPECT_THAT(test::complaint_of<DataError>([&] { LogFile log(folder_.path("none.csv")); }),
              HasSubstr("no such file"));
  EXPECT_THAT(test::complaint_of<DataError>([&] { LogFile log(folder_.path("")); }),
              HasSubstr("is a directory"));
}

TEST_F(LogFiles, MayBeWide) {
  constexpr std::size_t width = 20000;
  std::string header = "t";
  std::string row = ",0.5";
  for (std::size_t i = 1; i < width; ++i) {
    header += ",channel_" + std::to_string(i);
    row += ",1.25";
  }
  const LogBlock all = read(header + "\n0" + row.substr(4) + "\n1" + row.substr(4) + "\n");
  ASSERT_EQ(all.size(), width);
  EXPECT_THAT(all.front(), ElementsAre(0.0, 1.0));
  EXPECT_THAT(all.back(), ElementsAre(1.25, 1.25));
  EXPECT_EQ(columns_.back(), "channel_19999");
}

TEST_F(LogFiles, MayHoldNumbersOfManyDigits) {
  EXPECT_THAT(read("t,x\n0,18446744073709551617\n1,-55342809431242372870\n"
                   "2,1.8446744073709551617\n3,9007199254740993\n"),
              ElementsAre(ElementsAre(0, 1, 2, 3),
                          ElementsAre(18446744073709551617.0, -55342809431242372870.0,
                                      1.8446744073709551617, 9007199254740992.0)));
}

// ---- NumPy ----

std::string npy(const std::string& header, const std::string& data) {
  std::string text = header;
  text += std::string((64 - (10 + text.size() + 1) % 64) % 64, ' ') + "\n";
  std::string file = "\x93NUMPY";
  file += '\1';
  file += '\0';
  file += static_cast<char>(text.size() & 0xFFU);
  file += static_cast<char>(text.size() >> 8U);
  return file + text + data;
}

template <typename Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  std::string bytes(numbers.size() * sizeof(Number), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

TEST_F(LogFiles, OfNumPyAreRead) {
  EXPECT_THAT(read(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }",
                       bytes_of<double>({1, 2, 3, 4, 5, 6}))),
              ElementsAre(ElementsAre(1, 4), ElementsAre(2, 5), ElementsAre(3, 6)));
  EXPECT_THAT(columns_, ElementsAre("c1", "c2", "c3"));
  EXPECT_THAT(read(npy("{'descr': '<i2', 'fortran_order': True, 'shape': (2, 3), }",
                       bytes_of<std::int16_t>({1, 2, 3, 4, 5, -6}))),
              ElementsAre(ElementsAre(1, 2), ElementsAre(3, 4), ElementsAre(5, -6)));
  EXPECT_THAT(read(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (3,), }",
                       bytes_of<float>({1, 2.5, 3}))),
              ElementsAre(ElementsAre(1, 2.5, 3)));
  EXPECT_THAT(read(npy("{'descr': '>u2', 'fortran_order': False, 'shape': (2,), }",
                       std::string("\x01\x00\x00\x02", 4))),
              ElementsAre(ElementsAre(256, 2)));
  std::string records;
  for (int i = 0; i < 2; ++i) {
    records += bytes_of<double>({i + 0.5}) + bytes_of<std::int32_t>({-i});
  }
  EXPECT_THAT(read(npy("{'descr': [('t', '<f8'), ('x', '<i4')], 'fortran_order': False, "
                       "'shape': (2,), }",
                       records)),
              ElementsAre(ElementsAre(0.5, 1.5), ElementsAre(0, -1)));
  EXPECT_THAT(columns_, ElementsAre("t", "x"));
}

TEST_F(LogFiles, OfNumPySayWhatIsWrong) {
  const std::string data = bytes_of<double>({1, 2, 3});
  EXPECT_THAT(complaint(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }", data)),
              HasSubstr("cut short: 1 of 2 rows"));
  EXPECT_THAT(complaint(npy("{'descr': '<c16', 'fortran_order': False, 'shape': (2,), }", data)),
              HasSubstr("contains '<c16'"));
  EXPECT_THAT(
      complaint(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 3), }", data)),
      HasSubstr("one dimension or two"));
  EXPECT_THAT(complaint(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (0,), }", data)),
              HasSubstr("is empty"));
  EXPECT_THAT(complaint("\x93NUMPY\1"), HasSubstr("cut short"));
}

// The stated dimensions may not exceed the bytes of the file.
TEST_F(LogFiles, OfNumPyClaimNoMoreThanTheyHave) {
  const std::string data = bytes_of<double>({1, 2, 3});
  for (const char* const order : {"False", "True"}) {
    for (const char* const shape : {"(300000000, 3)", "(2, 9999)", "(1000000000000,)"}) {
      const std::string header =
          "{'descr': '<f8', 'fortran_order': " + std::string(order) + ", 'shape': " + shape + ", }";
      test::forget_largest_allocation();
      EXPECT_THAT(complaint(npy(header, data)), HasSubstr("cut short")) << header;
      EXPECT_LT(test::largest_allocation(), std::size_t{8} << 20U) << header;
    }
  }
  const auto with = [](const std::string& descr, const std::string& rest) {
    return npy("{'descr': " + descr + ", 'fortran_order': False, " + rest, "");
  };
  EXPECT_THAT(complaint(with("'<f8'", "'shape': (2, 4000000000), }")), HasSubstr("cut short"));
  EXPECT_THAT(complaint(with("'<f8'", "'shape': (20000, 4000000000), }")),
              HasSubstr("more than 10000"));
  EXPECT_THAT(complaint(with("[]", "'shape': (2,), }")), HasSubstr("without fields"));
  for (const char* const shape : {"'shape':", "'shape': (", "'shape': 5", "'shape': (1.5,)",
                                  "'shape': (1e300,)", "'shape': (-1,)", "'shape': (nan,)"}) {
    EXPECT_THAT(complaint(with("'<f8'", shape)), HasSubstr("has no shape")) << shape;
  }
}

// ---- compressed ----

#ifdef AXISCAL_LIBARCHIVE
std::string packed(const std::string& text, int (*filter)(archive*)) {
  std::string bytes(text.size() + 100000, '\0');
  std::size_t used = 0;
  archive* const a = archive_write_new();
  filter(a);
  archive_write_set_format_raw(a);
  archive_write_set_bytes_in_last_block(a, 1);
  archive_write_open_memory(a, bytes.data(), bytes.size(), &used);
  archive_entry* const entry = archive_entry_new();
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_write_header(a, entry);
  archive_write_data(a, text.data(), text.size());
  archive_write_close(a);
  archive_entry_free(entry);
  archive_write_free(a);
  bytes.resize(used);
  return bytes;
}

TEST_F(LogFiles, AreUnpacked) {
  std::string text = "t,x\n";
  for (int i = 0; i < 20000; ++i) {
    text += std::to_string(i) + "," + std::to_string(i % 1000) + "\n";
  }
  for (const auto filter : {archive_write_add_filter_gzip, archive_write_add_filter_bzip2,
                            archive_write_add_filter_xz, archive_write_add_filter_zstd,
                            archive_write_add_filter_lz4, archive_write_add_filter_lzip}) {
    const std::string bytes = packed(text, filter);
    const LogBlock all = read(bytes);
    EXPECT_EQ(all[0].size(), 20000U);
    EXPECT_EQ(all[1].back(), 999.0);
    EXPECT_THAT(notes_, testing::Contains(HasSubstr("unpacked")));
    EXPECT_THAT(complaint(bytes.substr(0, bytes.size() / 2)), HasSubstr("damaged or cut short"));
  }
  // Concatenated compressed streams are one file, for each kind of compression.
  for (const auto filter : {archive_write_add_filter_bzip2, archive_write_add_filter_xz,
                            archive_write_add_filter_zstd, archive_write_add_filter_lz4}) {
    EXPECT_EQ(read(packed(text, filter) + packed("1,2\n", filter))[0].size(), 20001U);
  }
  EXPECT_THAT(complaint(packed(text, archive_write_add_filter_compress)),
              HasSubstr("is compressed (compress), but this build of axiscal cannot unpack"));
  // A wrong checksum is reported.
  const std::string gzip = packed(text, archive_write_add_filter_gzip);
  EXPECT_EQ(read(gzip + packed("1,2\n", archive_write_add_filter_gzip))[0].size(), 20001U);
  std::string wrong = gzip;
  wrong[wrong.size() - 6] = static_cast<char>(wrong[wrong.size() - 6] ^ 1);
  EXPECT_THAT(complaint(wrong), HasSubstr("damaged or cut short"));
}

std::string zipped(const std::vector<std::pair<std::string, std::string>>& members) {
  std::string bytes(100000, '\0');
  std::size_t used = 0;
  archive* const a = archive_write_new();
  archive_write_set_format_zip(a);
  archive_write_open_memory(a, bytes.data(), bytes.size(), &used);
  for (const auto& [name, text] : members) {
    archive_entry* const entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_size(entry, static_cast<la_int64_t>(text.size()));
    archive_write_header(a, entry);
    archive_write_data(a, text.data(), text.size());
    archive_entry_free(entry);
  }
  archive_write_close(a);
  archive_write_free(a);
  bytes.resize(used);
  return bytes;
}

TEST_F(LogFiles, OfNumPyKeepTheirArraysApart) {
  const auto array = [](const std::vector<double>& numbers) {
    return npy("{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }", bytes_of(numbers));
  };
  EXPECT_THAT(read(zipped({{"t.npy", array({0, 1, 2})},
                           {"left/x.npy", array({1, 2, 3})},
                           {"right/x.npy", array({4, 5, 6})},
                           {"right/y.npy", array({7, 8, 9})}})),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(1, 2, 3), ElementsAre(4, 5, 6),
                          ElementsAre(7, 8, 9)));
  EXPECT_THAT(columns_, ElementsAre("t", "left/x", "right/x", "y"));
}
#endif

// ---- MATLAB ----

#ifdef AXISCAL_MATIO
TEST_F(LogFiles, OfMatlabAreRead) {
  for (const auto version : {MAT_FT_MAT5, MAT_FT_MAT73}) {
    const std::string path = folder_.path("log.mat");
    mat_t* const file = Mat_CreateVer(path.c_str(), nullptr, version);
    ASSERT_NE(file, nullptr);
    std::vector<double> t = {0, 1, 2, 3};
    std::vector<double> acc = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};  // column-major order
    std::vector<float> gain = {9};
    const auto write = [&](const char* name, matio_classes c, matio_types type, void* data,
                           std::size_t rows, std::size_t columns) {
      std::array<std::size_t, 2> dims = {rows, columns};
      matvar_t* const variable = Mat_VarCreate(name, c, type, 2, dims.data(), data, 0);
      EXPECT_EQ(Mat_VarWrite(file, variable, MAT_COMPRESSION_NONE), 0);
      Mat_VarFree(variable);
    };
    write("t", MAT_C_DOUBLE, MAT_T_DOUBLE, t.data(), 1, 4);
    write("acc", MAT_C_DOUBLE, MAT_T_DOUBLE, acc.data(), 4, 3);
    write("gain", MAT_C_SINGLE, MAT_T_SINGLE, gain.data(), 1, 1);
    Mat_Close(file);
    LogFile log(path);
    EXPECT_THAT(log.columns(), testing::UnorderedElementsAre("t", "acc_1", "acc_2", "acc_3"));
    const LogBlock all = read_log(log);
    EXPECT_THAT(all[log.need("acc_2")], ElementsAre(5, 6, 7, 8));
    EXPECT_THAT(all[log.need("t")], ElementsAre(0, 1, 2, 3));
  }
}
#endif

// A MAT file with one 3 x 2 array of doubles, made by the description of the format.
std::string mat5(std::uint32_t rows, std::uint32_t columns, std::uint32_t data_bytes) {
  const auto u32 = [](std::uint32_t value) { return bytes_of<std::uint32_t>({value}); };
  const std::string array = u32(6) + u32(8) + u32(6) + u32(0) +                  // flags: double
                            u32(5) + u32(8) + u32(rows) + u32(columns) +         // dimensions
                            u32((1U << 16U) | 1U) + std::string("x\0\0\0", 4) +  // name
                            u32(9) + u32(data_bytes) + bytes_of<double>({1, 2, 3, 4, 5, 6});
  std::string header = "MATLAB 5.0 MAT-file, by hand";
  header.resize(124, ' ');
  return header + std::string("\0\1IM", 4) + u32(14) +
         u32(static_cast<std::uint32_t>(array.size())) + array;
}

TEST_F(LogFiles, OfMatlabClaimNoMoreThanTheyHave) {
  EXPECT_THAT(read(mat5(3, 2, 48)), ElementsAre(ElementsAre(1, 2, 3), ElementsAre(4, 5, 6)));
  const std::string good = mat5(3, 2, 48);
  for (std::size_t size = 128; size < good.size(); ++size) {
    EXPECT_THAT(complaint(good.substr(0, size)), testing::AnyOf(HasSubstr("damaged or cut short"),
                                                                HasSubstr("no column of numbers")))
        << size;
  }
  test::forget_largest_allocation();
  EXPECT_THAT(complaint(mat5(300000000, 2, 48)), HasSubstr("300000000 x 2, but has 48 bytes"));
  EXPECT_THAT(complaint(mat5(300000000, 2, 0xFFFFFFF0U)), HasSubstr("damaged or cut short"));
  EXPECT_LT(test::largest_allocation(), std::size_t{8} << 20U);
  EXPECT_THAT(complaint(mat5(0xFFFFFFFFU, 2, 48)), HasSubstr("no column of numbers"));
}

// The expected values are by scipy (shared/data, SOURCE.md of the folders).
TEST_F(LogFiles, OfMatlabAreThoseThatWerePublished) {
  struct Published {
    const char* file;
    std::array<double, 3> means;
  };
  const std::array<Published, 3> all = {
      {{"log_matlab5/x_forward_accel_compressed.mat",
        {-0.00664517958, -0.001543511949, -1.034533964}},
       {"log_matlab5/x_forward_gyro_plain.mat", {4.531263542, 0.04646244341, 1.12164047}},
       {"log_matlab73/x_forward_mpu6050_accelerometer.mat",
        {-0.00664517958, -0.001543511949, -1.034533964}}}};
  for (const Published& one : all) {
    const std::optional<std::string> path = test::data_file(one.file);
    if (!path) {
      GTEST_SKIP() << "no " << one.file << " in AXISCAL_DATA_DIR";
    }
    LogFile log(*path);
    const LogBlock block = read_log(log);
    ASSERT_EQ(block.size(), 4U);
    ASSERT_EQ(block[0].size(), 12243U);
    EXPECT_NEAR(block[0].back(), 123.1997713, 1e-7);
    for (std::size_t k = 0; k < 3; ++k) {
      const double mean = std::accumulate(block[k + 1].begin(), block[k + 1].end(), 0.0) / 12243.0;
      EXPECT_NEAR(mean, one.means[k], 1e-9 * std::max(1.0, std::abs(one.means[k]))) << one.file;
    }
  }
}

#ifdef AXISCAL_MATIO
// Files that are damaged in many places give an answer or an error. The process of the test does
// not end.
TEST_F(LogFiles, OfMatlab73ThatAreDamagedDoNoHarm) {
  const std::optional<std::string> path =
      test::data_file("log_matlab73/x_forward_mpu6050_temperature.mat");
  if (!path) {
    GTEST_SKIP() << "no log_matlab73 in AXISCAL_DATA_DIR";
  }
  const std::string good = test::read_file(*path);
  EXPECT_THAT(complaint(good.substr(0, good.size() / 2)),
              testing::AnyOf(HasSubstr("damaged"), HasSubstr("no column of numbers")));
  RandomStream random(3);
  int errors = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::string bad = good;
    for (int k = 0; k < 20; ++k) {
      bad[512 + random.index(4096)] = static_cast<char>(random.index(256));
    }
    try {
      read(bad);
    } catch (const DataError&) {
      ++errors;
    }
  }
  EXPECT_GT(errors, 20);
}
#endif

}  // namespace
}  // namespace axiscal
