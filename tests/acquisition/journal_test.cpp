// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/journal.hpp"

#include <csignal>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

const std::string first = R"({"entry":"session","format":"axiscal-journal","version":1})";

TEST(Journal, KeepsLinesAndOpensAgain) {
  const test::ScratchFolder folder;
  const std::string path = folder.path("a.journal");
  {
    Journal journal = Journal::create(path);
    EXPECT_EQ(journal.append(first), "");
    EXPECT_EQ(journal.append_later("two"), "");
  }
  std::vector<std::string> lines;
  Journal journal = Journal::open(path, lines);
  EXPECT_EQ(lines, (std::vector<std::string>{first, "two"}));
  EXPECT_EQ(journal.append("three"), "");
  EXPECT_EQ(test::read_file(path), first + "\ntwo\nthree\n");
}

// What is no journal loses nothing by being taken for one.
TEST(Journal, LeavesOtherFilesAsTheyAre) {
  const test::ScratchFolder folder;
  for (const std::string text : {"notes\nwithout an end", "", "{\"format\":\"axiscal-journal\"",
                                 "{\"format\":\"axiscal-limits\",\"version\":1}\nx"}) {
    const std::string path = folder.write("notes.txt", text);
    std::vector<std::string> lines;
    EXPECT_THROW(static_cast<void>(Journal::open(path, lines)), DataError) << text;
    EXPECT_EQ(test::read_file(path), text);
  }
  std::vector<std::string> lines;
  EXPECT_THROW(static_cast<void>(Journal::open("/dev/zero", lines)), DataError);
}

TEST(Journal, CutsOffALineThatWasNotWrittenWhole) {
  const test::ScratchFolder folder;
  const std::string path = folder.write("a.journal", first + "\ntwo\n{\"entry\":\"capt");
  std::vector<std::string> lines;
  Journal journal = Journal::open(path, lines);
  EXPECT_EQ(lines.size(), 2U);
  EXPECT_EQ(journal.append("three"), "");
  EXPECT_EQ(test::read_file(path), first + "\ntwo\nthree\n");
}

TEST(Journal, RefusesAFileThatIsThereAndASecondWriter) {
  const test::ScratchFolder folder;
  const std::string path = folder.path("a.journal");
  const Journal journal = Journal::create(path);
  EXPECT_NE(test::complaint_of<OutputError>([&] {
              const Journal other = Journal::create(path);
            }).find("--resume"),
            std::string::npos);
  std::vector<std::string> lines;
  EXPECT_NE(test::complaint_of<OutputError>([&] {
              const Journal other = Journal::open(path, lines);
            }).find("another session"),
            std::string::npos);
}

TEST(Journal, AFullDiskLeavesWhatWasThere) {
  const test::ScratchFolder folder;
  const std::string path = folder.path("a.journal");
  Journal journal = Journal::create(path);
  EXPECT_EQ(journal.append("first"), "");
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit full{.rlim_cur = 10, .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &full);
  const std::string why = journal.append("second, too long");
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_NE(why.find(path), std::string::npos);
  EXPECT_EQ(test::read_file(path), "first\n");
  EXPECT_EQ(journal.append("second, too long"), "");
  EXPECT_EQ(test::read_file(path), "first\nsecond, too long\n");
}

}  // namespace
}  // namespace axiscal
