// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <sstream>

#include "axiscal/calib/certificate_details.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/limits.hpp"
#include "axiscal/calib/world.hpp"
#include "axiscal/logs/log_file.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

TEST(Usage, HelpAndVersionGoToStandardOutput) {
  const ProgramResult version = run_axiscal({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out, "axiscal 0.1.0\n");
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

void expect_to_fit(const std::string& text, std::size_t rows) {
  const std::vector<std::string> lines = lines_of(text);
  EXPECT_LE(lines.size(), rows) << text;
  for (const std::string& line : lines) {
    EXPECT_LE(line.size(), 80U) << text;
  }
}

// Help begins with examples and fits a terminal of 80 x 24. The whole help has the same width.
TEST(Usage, HelpFitsATerminal) {
  const std::string overview = run_axiscal({"help"}).out;
  EXPECT_EQ(run_axiscal({"--help"}).out, overview);
  EXPECT_EQ(run_axiscal({"-h"}).out, overview);
  expect_to_fit(overview, 24);
  const ProgramResult alone = run_axiscal({});
  EXPECT_EQ(alone.status, 2);
  EXPECT_THAT(alone.err, HasSubstr(overview));

  int subcommands = 0;
  for (const std::string& line : lines_of(overview)) {
    if (!line.starts_with("  ") || line.starts_with("  axiscal")) {
      continue;
    }
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    SCOPED_TRACE(name);
    const ProgramResult help = run_axiscal({name, "--help"});
    EXPECT_EQ(help.status, 0);
    EXPECT_EQ(help.err, "");
    EXPECT_TRUE(help.out.starts_with("  axiscal " + name) || name == "apply") << help.out;
    EXPECT_THAT(help.out, HasSubstr("Usage: axiscal " + name));
    EXPECT_EQ(run_axiscal({"help", name}).out, help.out);
    expect_to_fit(help.out, 24);
    expect_to_fit(run_axiscal({name, "--help-all"}).out, 400);
    ++subcommands;
  }
  EXPECT_EQ(subcommands, 20);
}

TEST(Usage, MistakesHaveStatusTwoAndAHint) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  const std::vector<std::string> good = {"calibrate",     run,       "--instrument",
                                         "accelerometer", "--field", "gravity"};
  ASSERT_EQ(run_axiscal(good).status, 0);
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = good;
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = run_axiscal(arguments);
    EXPECT_EQ(result.status, 2) << testing::PrintToString(more) << result.err;
    EXPECT_EQ(result.out, "");
    return result.err;
  };
  EXPECT_THAT(with({"--metod", "joint"}), HasSubstr("did you mean '--method'?"));
  EXPECT_THAT(with({"--method", "best"}), HasSubstr("paired, joint, known"));
  EXPECT_THAT(with({"--method"}), HasSubstr("--method"));
  EXPECT_THAT(with({"--method", "joint", "--method", "paired"}), HasSubstr("--method"));
  EXPECT_THAT(with({"--slope", "1"}), HasSubstr("--slope"));
  EXPECT_THAT(with({"--slope", "-1,-1"}), HasSubstr("--slope"));
  EXPECT_THAT(with({"--field-magnitude", "-1"}), HasSubstr("--field-magnitude"));
  EXPECT_THAT(with({"--field-unit", "m/s^2"}), HasSubstr("--latitude"));
  EXPECT_THAT(with({"--field-unit", "furlong"}), HasSubstr("g or m/s^2"));
  EXPECT_THAT(with({"--latitude", "91"}), HasSubstr("latitude"));
  EXPECT_THAT(with({"--height", "3"}), HasSubstr("--latitude"));
  EXPECT_THAT(with({"--date", "tomorrow"}), HasSubstr("--date"));
  EXPECT_THAT(with({"--convention", "ned"}), HasSubstr("flu or frd"));
  EXPECT_THAT(with({"--weights", "all"}), HasSubstr("--weights"));
  EXPECT_THAT(with({"--leave-out", "7,x"}), HasSubstr("--leave-out"));
  EXPECT_THAT(with({"--leave-out", "77"}), HasSubstr("run 77 cannot be left out"));
  EXPECT_THAT(with({"--axes", "x,,z"}), HasSubstr("--axes"));
  EXPECT_THAT(with({"other.json"}), HasSubstr("give no other file with it"));
  EXPECT_THAT(with({"--serial", "", "--json"}), HasSubstr("--serial: its value is empty"));
  EXPECT_THAT(with({"-o", ""}), HasSubstr("-o: its value is empty"));
  EXPECT_THAT(with({"-o", run}), HasSubstr("would be overwritten"));
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {},
           {"calibrat"},
           {"--frobnicate"},
           {"calibrate"},
           {"calibrate", run},
           {"calibrate", run, "--field", "gravity"},
           {"calibrate", run, "--instrument", "sextant", "--field", "gravity"},
           {"apply"},
           {"apply", run},
           {"plan", "--design", "13"},
           {"plan", "--replicates", "0"},
           {"plan", "--seed", "-1"},
           {"simulate"},
           {"simulate", "--truth", run, "--noise", "-1"}}) {
    const ProgramResult result = run_axiscal(arguments);
    EXPECT_EQ(result.status, 2) << testing::PrintToString(arguments) << result.err;
    EXPECT_NE(result.err, "");
  }
  EXPECT_THAT(run_axiscal({"calibrat"}).err, HasSubstr("did you mean 'calibrate'?"));
}

TEST(Usage, WhatLaterVersionsBringIsRefusedNotPassedOver) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  for (const std::vector<std::string>& later : std::vector<std::vector<std::string>>{
           {"--imu", "log.csv", "--method", "attitude"}, {"-o", "cal-{slot}.json"}}) {
    std::vector<std::string> arguments = {"calibrate",     run,       "--instrument",
                                          "accelerometer", "--field", "gravity"};
    arguments.insert(arguments.end(), later.begin(), later.end());
    EXPECT_EQ(run_axiscal(arguments).status, 2) << testing::PrintToString(later);
  }
  EXPECT_EQ(folder.file_count(), 1U);
  for (const char* subcommand : {"export", "import", "report", "acquire"}) {
    EXPECT_EQ(run_axiscal({subcommand}).status, 2) << subcommand;
  }
}

// ---- what is made from the command's own definitions ----

std::string completed(const std::string& words, int position) {
  const ScratchFolder folder;
  folder.write("axiscal.bash", run_axiscal({"--generate", "bash"}).out);
  const std::string command =
      "bash -c 'source \"" + folder.path("axiscal.bash") + "\"; COMP_WORDS=(" + words +
      "); COMP_CWORD=" + std::to_string(position) + "; _axiscal; echo \"${COMPREPLY[*]}\"' > '" +
      folder.path("out") + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return read_file(folder.path("out"));
}

TEST(Generated, BashCompletesSubcommandsOptionsAndChoices) {
  EXPECT_EQ(completed("axiscal exp", 1), "export\n");
  EXPECT_EQ(completed("axiscal study --mer", 2), "--merge\n");
  EXPECT_EQ(completed("axiscal budget --pitch-formula a", 3), "asin atan2\n");
}

TEST(Generated, TheManualPageHasEverySubcommandAndOption) {
  const std::string page = run_axiscal({"--generate", "man"}).out;
  for (const char* const name :
       {"field", "plan", "simulate", "segment", "noise", "calibrate", "apply", "check", "level",
        "characterize", "study", "export", "import", "report"}) {
    EXPECT_THAT(page, HasSubstr("\n.SS " + std::string(name) + "\n"));
  }
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-accept\\-suggestion\\fR"));
  EXPECT_EQ(page.find("\n\'"), std::string::npos);  // no line begins as a roff request
}

TEST(Generated, ZshAndFishHaveThemToo) {
  EXPECT_THAT(run_axiscal({"--generate", "zsh"}).out, HasSubstr("'--reading-factor["));
  EXPECT_THAT(run_axiscal({"--generate", "fish"}).out,
              HasSubstr("'__fish_seen_subcommand_from export' -l reading-factor -r"));
  EXPECT_EQ(run_axiscal({"--generate", "csh"}).status, 2);
  EXPECT_EQ(run_axiscal({"--generate"}).status, 2);
}

TEST(Generated, ValuesAreCompleted) {
  const std::string bash = run_axiscal({"--generate", "bash"}).out;
  EXPECT_THAT(bash,
              HasSubstr("'calibrate --instrument') COMPREPLY=($(compgen -W \"accelerometer "));
  EXPECT_THAT(bash,
              HasSubstr("'calibrate --method') COMPREPLY=($(compgen -W \"paired joint known "));
  EXPECT_THAT(bash, HasSubstr("'calibrate --field') COMPREPLY=($(compgen -W \""));
  // The completion offers every export format.
  const std::string list = run_axiscal({"export", "--list"}).out;
  std::string names;
  for (std::size_t at = 0; at < list.size(); at = list.find('\n', at) + 1) {
    if (list[at] != ' ') {
      names += (names.empty() ? "" : " ") + list.substr(at, list.find(' ', at) - at);
    }
  }
  EXPECT_THAT(bash, HasSubstr("'export --format') COMPREPLY=($(compgen -W \"" + names + "\""));
}

TEST(Common, QuietPrintsErrorsAlone) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  const std::vector<std::string> arguments = {
      "calibrate", run,       "--instrument", "accelerometer",
      "--field",   "gravity", "-o",           folder.path("cal.json")};
  const ProgramResult loud = run_axiscal(arguments);
  EXPECT_NE(loud.out, "");
  std::vector<std::string> quietly = arguments;
  quietly.emplace_back("--quiet");
  const ProgramResult quiet = run_axiscal(quietly);
  EXPECT_EQ(quiet.status, loud.status);
  EXPECT_EQ(quiet.out + quiet.err, "");
  quietly[1] = folder.path("none.csv");
  const ProgramResult failed = run_axiscal(quietly);
  EXPECT_EQ(failed.status, 3);
  EXPECT_THAT(failed.err, HasSubstr("none.csv"));
}

TEST(Common, ThreadsDoNotChangeTheResult) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  const auto record = [&](const std::string& jobs) {
    const ProgramResult result = run_axiscal({"calibrate", run, "--instrument", "accelerometer",
                                              "--field", "gravity", "--json", "--jobs", jobs});
    EXPECT_EQ(result.status, 0) << result.err;
    return nlohmann::json::parse(result.out).at("coefficients");
  };
  EXPECT_EQ(record("1"), record("3"));
  EXPECT_EQ(run_axiscal({"field", "--jobs", "0"}).status, 2);
}

TEST(Common, RecordsCanStateAnEarlierTime) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  ::setenv("SOURCE_DATE_EPOCH", "1000000000", 1);
  const auto record = [&] {
    return run_axiscal(
               {"calibrate", run, "--instrument", "accelerometer", "--field", "gravity", "--json"})
        .out;
  };
  const std::string first = record();
  EXPECT_EQ(first, record());
  ::unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_EQ(nlohmann::json::parse(first).at("created"), "2001-09-09T01:46:40Z");
}

TEST(Version, NamesLibrariesAndPrograms) {
  EXPECT_THAT(run_axiscal({"--version"}).out, testing::MatchesRegex("axiscal [0-9.]+\n"));
  const std::string all = run_axiscal({"--version", "--verbose"}).out;
  EXPECT_THAT(all, HasSubstr("Eigen"));
  EXPECT_THAT(all, HasSubstr("axiscal-report"));
}

TEST(Template, IsReadByWhatReadsItsFile) {
  const ScratchFolder folder;
  const auto written = [&](const std::string& name) {
    const std::string path = folder.path(name + ".json");
    EXPECT_EQ(run_axiscal({"template", name, "-o", path}).status, 0) << name;
    return path;
  };
  EXPECT_EQ(read_experiment(written("experiment")).experiment.instrument.serial, "QA-113");
  EXPECT_EQ(read_limits(written("limits")).limits.size(), 7U);
  EXPECT_EQ(read_certificate_details(written("laboratory")).number, "");  // a placeholder
  EXPECT_EQ(read_log_format(written("map")).columns.front().factor, 1e-6);
  EXPECT_EQ(read_positioner(written("positioner")).id(), "cube-07");
  EXPECT_EQ(world_text(read_world(written("world"))), "block_sd=1e-04,ar=0.5,k2=3e-04:0:0");
}

TEST(Template, NamesThoseThatThereAre) {
  const ProgramResult result = run_axiscal({"template", "limit"});
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.err, HasSubstr("did you mean 'limits'"));
  EXPECT_THAT(result.err, HasSubstr("experiment, laboratory, limits, map, positioner"));
}

}  // namespace
}  // namespace axiscal::test
