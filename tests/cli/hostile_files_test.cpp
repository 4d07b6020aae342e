// SPDX-License-Identifier: Apache-2.0
// Damaged and malicious files: losses are reported, excessive costs are refused, and no temporary
// files remain.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "strangers.hpp"

#ifdef AXISCAL_ZLIB
#include <zlib.h>
#endif
#ifdef AXISCAL_HDF5
#include <hdf5/serial/hdf5.h>
#endif
#ifdef AXISCAL_SQLITE
#include <sqlite3.h>
#endif

namespace axiscal::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class HostileFiles : public testing::Test {
 protected:
  // Runs a line of shell. In this line `axiscal` is the command under test.
  [[nodiscard]] int shell(const std::string& line) const {
    const std::string script =
        "axiscal() { '" + command_path() + "' \"$@\"; }; cd '" + folder_.path("") + "'; " + line;
    return WEXITSTATUS(std::system(("bash -c '" + in_quotes(script) + "'").c_str()));
  }

  static std::string in_quotes(const std::string& text) {
    std::string safe;
    for (const char c : text) {
      safe += c == '\'' ? "'\\''" : std::string(1, c);
    }
    return safe;
  }

  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path(""))) {
      all.push_back(entry.path().filename().string());
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  // Writes the record `cal_` of 12 readings of the instrument.
  [[nodiscard]] int calibrate() {
    const std::string run = folder_.write("run.csv", twelve_readings(instrument_));
    return run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field-unit", "m/s^2",
                        "--field-magnitude", "9.80665", "-o", cal_})
        .status;
  }

  ScratchFolder folder_;
  StrangeInstrument instrument_;
  std::string cal_ = folder_.path("cal.json");
};

// @return the table; the rows from `first` on, `count` in number, lack their last cell.
std::string with_cut_rows(const std::string& table, std::size_t first, std::size_t count) {
  std::string text;
  std::size_t row = 0;
  for (std::size_t at = 0; at < table.size();) {
    const std::size_t end = std::min(table.find('\n', at), table.size());
    std::string line = table.substr(at, end - at);
    if (row >= first && row < first + count) {
      line.resize(line.rfind(','));
    }
    text += line + "\n";
    ++row;
    at = end + 1;
  }
  return text;
}

TEST_F(HostileFiles, RowsThatDoNotParseAreAnErrorWhereverTheyStand) {
  const std::string whole = twelve_readings(instrument_);
  const auto rows = static_cast<std::size_t>(std::count(whole.begin(), whole.end(), '\n')) - 1;
  for (const auto& [first, count] :
       std::vector<std::pair<std::size_t, std::size_t>>{{1, 1}, {1, 3}, {rows - 2, 2}, {5, 2}}) {
    const std::string run = folder_.write("run.csv", with_cut_rows(whole, first, count));
    const ProgramResult result =
        run_axiscal({"calibrate", run, "--instrument", "accelerometer", "-o", cal_});
    EXPECT_EQ(result.status, 3) << first;
    EXPECT_THAT(result.err, HasSubstr("run.csv:" + std::to_string(first + 1) + ": the row has"));
  }
}

TEST_F(HostileFiles, ACellOfSeveralLinesHidesNoRows) {
  const std::string table = twelve_readings(instrument_);
  std::string text = "note," + table.substr(0, table.find('\n') + 1);
  std::size_t row = 0;
  for (std::size_t at = table.find('\n') + 1; at < table.size();) {
    const std::size_t end = table.find('\n', at);
    text += (row++ < 6 ? "\"two\nlines\"," : "note,") + table.substr(at, end - at) + "\n";
    at = end + 1;
  }
  const ProgramResult result = run_axiscal(
      {"calibrate", folder_.write("run.csv", text), "--instrument", "accelerometer", "--json"});
  EXPECT_THAT(result.out, HasSubstr("\"run\": " + std::to_string(row))) << result.err;
}

TEST_F(HostileFiles, ApplyReportsItsFirstRowsToo) {
  ASSERT_EQ(calibrate(), 0);
  const std::string log = folder_.write("log.csv", "x,y,z\n1,2\n1,2\n0,0,1\n0,1,0\n1,0,0\n");
  const ProgramResult result = run_axiscal({"apply", cal_, log});
  EXPECT_THAT(result.err, HasSubstr("2 of 5 rows gave no result (the first is line 2)"));
  EXPECT_THAT(result.out, HasSubstr("1,2,")) << "the row is there";
}

TEST_F(HostileFiles, ALimitIsNamedAndCanBeRaised) {
  std::string cells = "[";
  for (int i = 0; i < 3000; ++i) {
    cells +=
        (i > 0 ? "," : "") + ("{\"c" + std::to_string(i)) + "\":1,\"x\":" + std::to_string(i) + "}";
  }
  const std::string wide = folder_.write("wide.json", cells + "]");
  const ProgramResult refused = run_axiscal({"log", wide, "--limit", "cells=1000"});
  EXPECT_EQ(refused.status, 3);
  EXPECT_THAT(refused.err,
              AllOf(HasSubstr("wide.json"), HasSubstr("'cells'"), HasSubstr("--limit NAME=VALUE")));
  EXPECT_EQ(run_axiscal({"log", wide, "--limit", "cells=1e8,memory=1e9"}).status, 0);
  for (const char* const wrong : {"cells", "sand=3", "cells=-1", "cells=many"}) {
    const ProgramResult result = run_axiscal({"log", wide, "--limit", wrong});
    EXPECT_EQ(result.status, 2) << wrong;
    EXPECT_THAT(result.err, HasSubstr("nesting, members, unpacked, cells, steps, memory, disk"));
  }
}

TEST_F(HostileFiles, ManyColumnsCostInProportion) {
  std::string header, row;
  for (int i = 0; i < 100000; ++i) {
    header += (i > 0 ? "," : "") + ("col" + std::to_string(i));
    row += i > 0 ? ",1" : "1";
  }
  const std::string wide =
      folder_.write("wide.csv", header + "\n" + row + "\n" + row + "\n" + row + "\n");
  // The limit is processor time, because the machine may be busy. A quadratic algorithm would need
  // 30 s or more.
  EXPECT_EQ(shell("ulimit -t 12; axiscal log '" + wide + "' >/dev/null"), 0);
}

TEST_F(HostileFiles, NothingIsReadButFilesOfAFolder) {
  std::filesystem::create_directory(folder_.path("rec"));
  ASSERT_EQ(::mkfifo(folder_.path("rec/a.csv").c_str(), 0600), 0);
  std::ofstream(folder_.path("rec/b.csv")) << "t,ax,ay,az\n0,0,0,9.8\n0.01,0,0,9.8\n0.02,0,0,9.8\n";
  EXPECT_EQ(shell("timeout 10 bash -c \"'" + command_path() + "' log rec\" >/dev/null"), 0);
}

TEST_F(HostileFiles, NoFolderForCopiesIsAnOutputThatCannotBeWritten) {
  folder_.write("log.csv", "t,ax,ay,az\n0,0,0,9.8\n0.01,0,0,9.8\n0.02,0,0,9.8\n");
  EXPECT_EQ(shell("TMPDIR= axiscal noise - <log.csv 2>err"), 4);
  EXPECT_EQ(shell("TMPDIR=/nowhere axiscal noise - <log.csv 2>err"), 4);
  EXPECT_THAT(read_file(folder_.path("err")), HasSubstr("TMPDIR"));
}

TEST_F(HostileFiles, ACopyIsGoneAfterASignal) {
  std::filesystem::create_directory(folder_.path("copies"));
  // The pipe stays open, and the command waits for more input.
  EXPECT_EQ(shell("( for i in 1 2 3; do printf \"t,ax\\n0,1\\n\"; done; sleep 5 ) | "
                  "( TMPDIR=copies timeout -s TERM 1 '" +
                  command_path() + "' noise - >/dev/null 2>&1; ls copies >left )"),
            0);
  EXPECT_EQ(read_file(folder_.path("left")), "");
}

#ifdef AXISCAL_SQLITE
TEST_F(HostileFiles, ABagIsOpenedWithoutATraceBesideIt) {
  const std::string bag = folder_.path("bag.db3");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(bag.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database,
                         "PRAGMA journal_mode=WAL;"
                         "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT);"
                         "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, "
                         "timestamp INTEGER, data BLOB);"
                         "INSERT INTO topics VALUES(1, '/t', 'std_msgs/msg/Float64');",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  ASSERT_EQ(::chmod(folder_.path("").c_str(), 0555), 0);
  const ProgramResult result = run_axiscal({"log", bag});
  ASSERT_EQ(::chmod(folder_.path("").c_str(), 0755), 0);
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(names(), testing::ElementsAre("bag.db3"));
}

TEST_F(HostileFiles, AViewIsNoTableOfABag) {
  const std::string bag = folder_.path("bag.db3");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(bag.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(
                database,
                "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT);"
                "CREATE VIEW messages AS WITH RECURSIVE c(i) AS (SELECT 1 UNION ALL SELECT i + 1 "
                "FROM c) SELECT i AS topic_id, i AS timestamp, x'00' AS data FROM c;",
                nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  const ProgramResult result = run_axiscal({"log", bag});
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.err, HasSubstr("messages"));
}
#endif

#ifdef AXISCAL_HDF5
TEST_F(HostileFiles, Hdf5ReadsNoOtherFile) {
  folder_.write("secret", std::string(800, 'x'));
  const std::string file = folder_.path("other.h5");
  const hid_t h5 = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t size = 100;
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t list = H5Pcreate(H5P_DATASET_CREATE);
  ASSERT_GE(H5Pset_external(list, folder_.path("secret").c_str(), 0, 800), 0);
  const hid_t set = H5Dcreate2(h5, "ax", H5T_IEEE_F64LE, space, H5P_DEFAULT, list, H5P_DEFAULT);
  H5Dclose(set);
  H5Pclose(list);
  H5Sclose(space);
  H5Fclose(h5);
  const ProgramResult result = run_axiscal({"log", file});
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.err, HasSubstr("other files"));
}
#endif

TEST_F(HostileFiles, TheStatusIsTheVerdictsWhoeverReads) {
  ASSERT_EQ(calibrate(), 0);
  StrangeInstrument drifted = instrument_;
  drifted.bias += Eigen::Vector3d(0.5, 0.0, 0.0);
  folder_.write("later.csv", twelve_readings(drifted));
  EXPECT_EQ(shell("axiscal check cal.json later.csv >/dev/null 2>&1"), 1);
  EXPECT_EQ(shell("set -o pipefail; axiscal check cal.json later.csv 2>/dev/null | true"), 1);
  EXPECT_EQ(shell("axiscal check cal.json later.csv >&- 2>err"), 4);
  EXPECT_THAT(read_file(folder_.path("err")), HasSubstr("standard output"));
}

TEST_F(HostileFiles, ATerminalIsSentNoControlCharacters) {
  const std::string log = folder_.write("log.csv",
                                        "t,\x1b]0;pwned\x07"
                                        "ax,\x1b[2Jay,az\n0,0,0,9.8\n0.01,0,0,9.8\n0.02,0,0,9.8\n");
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"log", log},
        {"noise", log},
        {"log", folder_.path("\x1b[31mx")},
        {"calibrate", log, "--instrument", "accelerometer"}}) {
    const ProgramResult result = run_axiscal(words);
    EXPECT_THAT(result.out + result.err, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\x07"))))
        << words.front();
  }
  EXPECT_THAT(run_axiscal({"log", log}).out, HasSubstr("\\x1B"));
}

TEST_F(HostileFiles, ASpreadsheetIsGivenNoFormulas) {
  ASSERT_EQ(calibrate(), 0);
  const std::string log = folder_.write(
      "log.csv", "note,x,y,z,d\n=HYPERLINK(1),0,0,-1.5,+X\n@cmd,0,1,0,-\n-2+3,1,0,0,-1e-3\n");
  const ProgramResult result = run_axiscal({"apply", cal_, log});
  EXPECT_THAT(result.out, AllOf(HasSubstr("'=HYPERLINK(1),0,0,-1.5,+X"), HasSubstr("'@cmd,0,1,0,-"),
                                HasSubstr("'-2+3,1,0,0,-1e-3")))
      << result.err;
}

#ifdef AXISCAL_ZLIB
// Each command that holds a log in memory reads a compressed log, whole and cut at any byte.
TEST_F(HostileFiles, CutFilesAreRefusedByEachCommand) {
  std::string text = "t,ax,ay,az,gx,gy,gz\n";
  for (int i = 0; i < 2000; ++i) {
    text += std::to_string(0.01 * i) + ",0.0" + std::to_string(i % 10) + ",0,9.8,0,0,0." +
            std::to_string(i % 7) + "\n";
  }
  const std::string path = folder_.path("log.csv.gz");
  gzFile out = gzopen(path.c_str(), "wb");
  ASSERT_EQ(gzwrite(out, text.data(), static_cast<unsigned>(text.size())),
            static_cast<int>(text.size()));
  gzclose(out);
  const std::string whole = read_file(path);
  EXPECT_EQ(run_axiscal({"noise", path}).status, 0);
  for (std::size_t part = 1; part <= 8; ++part) {
    const std::string cut = folder_.write("cut.csv.gz", whole.substr(0, whole.size() * part / 9));
    std::string damaged = whole;
    damaged[whole.size() * part / 9] ^= 0x55;
    const std::string bad = folder_.write("bad.csv.gz", damaged);
    for (const std::string& file : {cut, bad}) {
      for (const std::vector<std::string>& words :
           {std::vector<std::string>{"noise", file},
            {"segment", file},
            {"calibrate", "--imu", file, "-o", folder_.path("imu.json")},
            {"log", file}}) {
        const ProgramResult result = run_axiscal(words);
        EXPECT_EQ(result.status, 3) << words.front() << " " << part << result.err;
        EXPECT_THAT(result.err, HasSubstr("damaged or cut short")) << words.front();
      }
    }
  }
}
#endif

}  // namespace
}  // namespace axiscal::test
