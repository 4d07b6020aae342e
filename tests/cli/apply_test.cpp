// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "allocations.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

class ApplyCommand : public testing::Test {
 protected:
  std::string record_with(const std::string& instrument_more, const std::string& kind) const {
    return folder_.write("cal.json", R"({"format": "axiscal-calibration", "version": 1,
        "instrument": {"kind": ")" + kind +
                                         R"(", "axes": ["x", "y", "z"], "unit": "V")" +
                                         instrument_more + R"(},
        "field": {"kind": "gravity", "unit": "g", "magnitude": 1},
        "coefficients": {"bias": [0.012, -0.034, 0.005],
          "sensitivity": [[2.5, 0.01, -0.02], [0.015, 2.48, 0.03], [-0.01, 0.02, 2.52]]}})");
  }

  static std::string readings_of(const Eigen::Vector3d& field) {
    const Eigen::VectorXd v = accelerometer_truth().response.at(field);
    return number_text(v(0)) + "," + number_text(v(1)) + "," + number_text(v(2)) + "\n";
  }

  const ScratchFolder folder_;
  const std::string record_ = record_with("", "accelerometer");
};

TEST_F(ApplyCommand, GivesComponentsAndAngles) {
  const double pitch = 20.0 * rad_per_deg;
  const double roll = -130.0 * rad_per_deg;
  const Eigen::Vector3d f(std::sin(pitch), std::sin(roll) * std::cos(pitch),
                          std::cos(roll) * std::cos(pitch));
  const std::string table = "t,x,y,z\n7," + readings_of(f) + "8," + readings_of({-1.0, 0.0, 0.0});
  const ProgramResult result = run_axiscal({"apply", record_, "-"}, {.stdin_text = table});
  EXPECT_EQ(result.status, 0) << result.err;
  const auto rows = csv_cells(result.out);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_THAT(rows[0],
              testing::ElementsAre("t", "x", "y", "z", "field_x", "field_y", "field_z", "residual",
                                   "pitch_deg", "roll_deg", "yaw_deg", "flag"));
  EXPECT_EQ(rows[1][0], "7");
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(std::stod(rows[1][4 + j]), f(static_cast<Eigen::Index>(j)), 1e-14);
  }
  EXPECT_NEAR(std::stod(rows[1][8]), 20.0, 1e-12);
  EXPECT_NEAR(std::stod(rows[1][9]), -130.0, 1e-12);
  EXPECT_EQ(rows[1][10], "");
  // If the nose points straight down, there is a yaw instead of a roll.
  EXPECT_NEAR(std::stod(rows[2][8]), -90.0, 1e-5);
  EXPECT_EQ(rows[2][9], "");
  EXPECT_NEAR(std::abs(std::stod(rows[2][10])), 180.0, 1e-9);
}

TEST_F(ApplyCommand, GivesRowsAsJson) {
  const std::string table =
      "t,\"a \"\"b\"\", c\",x,y,z\n7,up," + readings_of({0.0, 0.0, 1.0}) + "8,,nan,0,0\n";
  const std::vector<std::string> lines = [&] {
    const ProgramResult result =
        run_axiscal({"apply", record_, "-", "--json"}, {.stdin_text = table});
    EXPECT_EQ(result.status, 0) << result.err;
    std::vector<std::string> all;
    for (const std::string_view line : split(result.out, '\n')) {
      all.emplace_back(line);
    }
    return all;
  }();
  ASSERT_EQ(lines.size(), 3U);  // the last element is empty
  const nlohmann::json row = nlohmann::json::parse(lines[0]);
  EXPECT_EQ(row.at("t"), 7);
  EXPECT_EQ(row.at("a \"b\", c"), "up");
  EXPECT_NEAR(row.at("field_z").get<double>(), 1.0, 1e-14);
  EXPECT_NEAR(row.at("pitch_deg").get<double>(), 0.0, 1e-12);
  const nlohmann::json bad = nlohmann::json::parse(lines[1]);
  EXPECT_TRUE(bad.at("x").is_null());
  EXPECT_EQ(bad.at("flag"), "unreadable");
  const ProgramResult binary = run_axiscal(
      {"apply", record_, "-", "--json", "-o", folder_.path("a.npy")}, {.stdin_text = table});
  EXPECT_EQ(binary.status, 2) << binary.err;
}

TEST_F(ApplyCommand, ObeysItsOptions) {
  const Eigen::Vector3d f(std::sin(1.4), 0.0, std::cos(1.4));  // a pitch of 80.2 degrees
  const std::string input = folder_.write("in.csv", "x,y,z\n" + readings_of(f));
  const auto cell = [&](const std::vector<std::string>& more, std::size_t column) {
    std::vector<std::string> arguments = {"apply", record_, input};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = run_axiscal(arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    return csv_cells(result.out).at(1).at(column);
  };
  EXPECT_NE(cell({}, 8), "") << "roll below 85 degrees";
  EXPECT_EQ(cell({"--yaw-above", "80"}, 8), "");
  EXPECT_NEAR(std::stod(cell({"--field-magnitude", "1.01"}, 6)), -0.01, 1e-14);
  EXPECT_NEAR(std::stod(cell({"--field-magnitude", "1.01", "--field-unit", "g"}, 7)),
              std::asin(f.x() / 1.01) * deg_per_rad, 1e-11);
  // atan2 does not need the magnitude.
  EXPECT_NEAR(std::stod(cell({"--pitch", "atan2", "--field-magnitude", "1.01"}, 7)),
              1.4 * deg_per_rad, 1e-12);
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--yaw-above", "91"},
                                             {"--pitch", "tan"},
                                             {"--field-unit", "m/s^2"},
                                             {"--field-magnitude", "0"}}) {
    std::vector<std::string> arguments = {"apply", record_, input};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    EXPECT_EQ(run_axiscal(arguments).status, 2);
  }
}

TEST_F(ApplyCommand, KnowsForwardRightDown) {
  const Eigen::Vector3d flu(0.0, std::sin(0.3), std::cos(0.3));
  const Eigen::Vector3d frd(flu.x(), -flu.y(), -flu.z());
  const std::string record = record_with(R"(, "convention": "frd")", "inclinometer");
  const ProgramResult result =
      run_axiscal({"apply", record, "-"}, {.stdin_text = "x,y,z\n" + readings_of(frd)});
  EXPECT_NEAR(std::stod(csv_cells(result.out).at(1).at(8)), 0.3 * deg_per_rad, 1e-12);
}

TEST_F(ApplyCommand, GivesNothingMoreForGenericInstruments) {
  const std::string record = record_with("", "generic");
  const ProgramResult result =
      run_axiscal({"apply", record, "-"}, {.stdin_text = "x,y,z\n0,0,1\n"});
  EXPECT_THAT(csv_cells(result.out)[0], testing::ElementsAre("x", "y", "z", "field_x", "field_y",
                                                             "field_z", "residual", "flag"));
}

TEST_F(ApplyCommand, CountsWhatItCannotReduce) {
  const std::string input = folder_.write("in.csv", "x,y,z\n0,0,2.5\n0,oops,2.5\n0,0\n");
  const ProgramResult result = run_axiscal({"apply", record_, input});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("2 of 3 rows gave no result (the first is line 3)"));
  EXPECT_EQ(csv_cells(result.out).size(), 4U);
  EXPECT_EQ(csv_cells(result.out)[2].back(), "unreadable");
  const std::string output = folder_.write("out.csv", "earlier");
  const ProgramResult strict = run_axiscal({"apply", record_, input, "--strict", "-o", output});
  EXPECT_EQ(strict.status, 3);
  EXPECT_THAT(strict.err, testing::StartsWith(input + ":3: column 'y': 'oops'"));
  EXPECT_EQ(read_file(output), "earlier");
}

TEST_F(ApplyCommand, DoesNotFollowWhatItWrites) {
  const std::string input = folder_.write("in.csv", "x,y,z\n0,0,2.5\n");
  EXPECT_EQ(run_axiscal({"apply", record_, input, "-o", input, "--follow"}).status, 2);
  EXPECT_EQ(read_file(input), "x,y,z\n0,0,2.5\n");
  EXPECT_EQ(run_axiscal({"apply", record_, input, "-o", record_}).status, 2);
}

TEST_F(ApplyCommand, NeedsItsColumns) {
  const std::string input = folder_.write("in.csv", "x,y\n1,2\n");
  const ProgramResult result = run_axiscal({"apply", record_, input});
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.err, testing::StartsWith(input + ":1: column 'z' is missing"));
}

TEST_F(ApplyCommand, FollowsAPipeLineByLine) {
  // The result of a row must be written before the next row is sent.
  std::array<int, 2> in{};
  std::array<int, 2> out{};
  ASSERT_EQ(::pipe2(in.data(), O_CLOEXEC), 0);
  ASSERT_EQ(::pipe2(out.data(), O_CLOEXEC), 0);
  const std::string command = command_path();
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(in[0], STDIN_FILENO);
    ::dup2(out[1], STDOUT_FILENO);
    ::execl(command.c_str(), command.c_str(), "apply", record_.c_str(), "-", "--follow", nullptr);
    ::_exit(127);
  }
  ::close(in[0]);
  ::close(out[1]);
  const auto send = [&](const std::string& text) {
    ASSERT_EQ(::write(in[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  };
  const auto receive = [&] {
    std::string line;
    char c = 0;
    while (::read(out[0], &c, 1) == 1 && c != '\n') {
      line += c;
    }
    return line;
  };
  send("x,y,z\n");
  EXPECT_THAT(receive(), testing::StartsWith("x,y,z,field_x"));
  for (int i = 0; i < 5; ++i) {
    send("0." + std::to_string(i) + ",0,2.5\n");
    EXPECT_THAT(receive(), testing::StartsWith("0." + std::to_string(i) + ",0,2.5,"));
  }
  ::close(in[1]);
  EXPECT_EQ(receive(), "");
  ::close(out[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(ApplyCommand, NeedsLittleMemoryWhateverTheSize) {
  if (under_address_sanitizer) {
    GTEST_SKIP() << "the address sanitizer takes memory of its own";
  }
  std::string table = "x,y,z\n";
  for (int i = 0; i < 200000; ++i) {
    table += "0.1,0.2,2.5\n0.3,-0.2,-2.5\n";
  }
  const std::string input = folder_.write("in.csv", table);
  // The memory of the libraries depends on the linking. A table with one row measures it.
  const std::string one_row = folder_.write("one.csv", "x,y,z\n0.1,0.2,2.5\n");
  EXPECT_EQ(run_axiscal({"apply", record_, one_row, "-o", folder_.path("one_out.csv")}).status, 0);
  rusage before{};
  ::getrusage(RUSAGE_CHILDREN, &before);
  const ProgramResult result =
      run_axiscal({"apply", record_, input, "-o", folder_.path("out.csv")});
  EXPECT_EQ(result.status, 0);
  const std::string output = read_file(folder_.path("out.csv"));
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 400001);
  rusage after{};
  ::getrusage(RUSAGE_CHILDREN, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 24 * 1024)
      << "KiB, the largest of all children so far";
}

}  // namespace
}  // namespace axiscal::test
