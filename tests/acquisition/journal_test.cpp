// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/journal.hpp"

#include <csignal>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "axiscal/acquisition/session_header.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/instruments/instrument.hpp"
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
    EXPECT_EQ(journal.append_without_sync("two"), "");
  }
  std::vector<std::string> lines;
  Journal journal = Journal::open(path, lines);
  EXPECT_EQ(lines, (std::vector<std::string>{first, "two"}));
  EXPECT_EQ(journal.append("three"), "");
  EXPECT_EQ(test::read_file(path), first + "\ntwo\nthree\n");
}

TEST(SessionHeader, ComesBackFromItsLine) {
  Experiment experiment;
  experiment.instrument = accelerometer("V");
  experiment.field = GravityField();
  const SessionHeader header{.directory = "/tmp/a b",
                             .arguments = {"acquire", "--connect", "sim:"},
                             .sheet = make_run_sheet(standard_design(12), 2, 5, {20.0, 40.0}),
                             .experiment = experiment_json(experiment)};
  const SessionHeader back = parse_session_header(session_header_line(header), "a.journal");
  EXPECT_EQ(back.directory, header.directory);
  EXPECT_EQ(back.arguments, header.arguments);
  EXPECT_EQ(experiment_json(parse_experiment(back.experiment, "a.journal").experiment),
            header.experiment);
  ASSERT_EQ(back.sheet.size(), header.sheet.size());
  for (std::size_t i = 0; i < back.sheet.size(); ++i) {
    EXPECT_EQ(back.sheet[i].run, header.sheet[i].run);
    EXPECT_EQ(back.sheet[i].block, header.sheet[i].block);
    EXPECT_EQ(back.sheet[i].entry.point, header.sheet[i].entry.point);
    EXPECT_EQ(back.sheet[i].temperature, header.sheet[i].temperature);
  }
  for (
      const std::string line :
      {R"({"directory":"/","arguments":["acquire"],"sheet":[]})",
       R"({"directory":"/","arguments":["acquire"],"sheet":[{"run":1,"block":1,"rest":"+X","fence":"-X","level":1}]})",
       R"({"directory":"/","arguments":["acquire"]})", "{", ""}) {
    EXPECT_THROW(static_cast<void>(parse_session_header(line, "a.journal")), DataError) << line;
  }
}

// Journal::open() rejects a file that is not a journal, and does not change it.
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
            }).find("exists already; resume its session"),
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
