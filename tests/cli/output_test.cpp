// SPDX-License-Identifier: Apache-2.0
// An output is replaced whole or left as it was, whatever happens.
#include <filesystem>

#include <sys/stat.h>

#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

class Output : public testing::Test {
 protected:
  std::vector<std::string> calibrate_to(const std::string& output) const {
    return {"calibrate", run_, "--instrument", "accelerometer", "--field", "gravity", "-o", output};
  }

  const ScratchFolder folder_;
  const std::string run_ =
      folder_.write("run.csv", observations_text(accelerometer_truth(), {.noise_sd = 1e-4}));
};

TEST_F(Output, OnAFullDiskTheEarlierFileStays) {
  const std::string output = folder_.write("cal.json", "earlier");
  // A limit on file size stands in for a full disk.
  const ProgramResult result = run_axiscal(calibrate_to(output), {.file_size_limit = 1000});
  EXPECT_EQ(result.status, 4);
  EXPECT_THAT(result.err, HasSubstr(output));
  EXPECT_EQ(read_file(output), "earlier");
  EXPECT_EQ(folder_.file_count(), 2U) << "no temporary file is left";
  const std::string readings = folder_.write(
      "in.csv", "x,y,z\n" + [] {
        std::string rows;
        for (int i = 0; i < 200; ++i) {
          rows += "0.1,0.2,2.5\n";
        }
        return rows;
      }());
  const std::string record = folder_.path("good.json");
  ASSERT_EQ(run_axiscal(calibrate_to(record)).status, 0);
  EXPECT_EQ(
      run_axiscal({"apply", record, readings, "-o", output}, {.file_size_limit = 1000}).status, 4);
  EXPECT_EQ(read_file(output), "earlier");
}

TEST_F(Output, AMissingFolderIsSaid) {
  for (const std::string& output : {folder_.path("no/cal.json"), folder_.path("")}) {
    const ProgramResult result = run_axiscal(calibrate_to(output));
    EXPECT_EQ(result.status, 4) << output;
    EXPECT_THAT(result.err, HasSubstr(output));
    EXPECT_EQ(run_axiscal({"plan", "-o", output}).status, 4);
  }
}

TEST_F(Output, ADeviceStaysADevice) {
  EXPECT_EQ(run_axiscal(calibrate_to("/dev/null")).status, 0);
  struct stat status {};
  ASSERT_EQ(::stat("/dev/null", &status), 0);
  EXPECT_TRUE(S_ISCHR(status.st_mode));
  EXPECT_EQ(run_axiscal(calibrate_to("/dev/full")).status, 4);
  EXPECT_EQ(run_axiscal({"plan"}, {.stdout_path = "/dev/full"}).status, 4);
  EXPECT_EQ(run_axiscal({"--help"}, {.stdout_path = "/dev/full"}).status, 4);
}

TEST_F(Output, ALinkIsFollowed) {
  const std::string target = folder_.write("target.json", "earlier");
  std::filesystem::create_symlink(target, folder_.path("link.json"));
  EXPECT_EQ(run_axiscal(calibrate_to(folder_.path("link.json"))).status, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.path("link.json")));
  EXPECT_EQ(read_json(target)["status"], "ok");
}

TEST_F(Output, CanReplaceItsOwnInput) {
  const std::string record = folder_.path("cal.json");
  ASSERT_EQ(run_axiscal(calibrate_to(record)).status, 0);
  const std::string readings = folder_.write("in.csv", "x,y,z\n0,0,2.5\n");
  EXPECT_EQ(run_axiscal({"apply", record, readings, "-o", readings}).status, 0);
  EXPECT_EQ(csv_cells(read_file(readings))[0].size(), 11U);
}

TEST_F(Output, AClosedStandardOutputIsNotMixedIntoTheRecord) {
  const std::string record = folder_.path("cal.json");
  const std::string command = "'" + command_path() + "' calibrate '" + run_ +
                              "' --instrument accelerometer --field gravity -o '" + record +
                              "' >&- 2>&-";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_json(record)["status"], "ok");
}

TEST_F(Output, ARefusalStaysOneWhenNobodyReads) {
  const std::string six = folder_.write(
      "six.csv",
      observations_text(accelerometer_truth(),
                        {.points = 6, .slope = {1e-4, -1e-4}, .noise_sd = 1e-3, .seed = 3}));
  const std::string command = "{ '" + command_path() + "' calibrate '" + six +
                              "' --instrument accelerometer --field gravity 2>'" +
                              folder_.path("err") + "'; echo $? >'" + folder_.path("status") +
                              "'; } | true";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(folder_.path("status")), "1\n");
  EXPECT_THAT(read_file(folder_.path("err")), HasSubstr("refused"));
}

TEST_F(Output, AReaderThatStopsEndsTheCommandQuietly) {
  const std::string record = folder_.path("cal.json");
  ASSERT_EQ(run_axiscal(calibrate_to(record)).status, 0);
  const std::string command =
      "{ yes 0.1,0.2,2.5 | head -n 300000 | sed '1i x,y,z'; } 2>/dev/null | " + std::string("{ '") +
      command_path() + "' apply '" + record + "' - 2>'" + folder_.path("err") + "'; echo $? >'" +
      folder_.path("status") + "'; } | head -n 1 >'" + folder_.path("out") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(read_file(folder_.path("err")), "");
  EXPECT_EQ(read_file(folder_.path("status")), "0\n");
  EXPECT_THAT(read_file(folder_.path("out")), testing::StartsWith("x,y,z,field_x"));
}

}  // namespace
}  // namespace axiscal::test
