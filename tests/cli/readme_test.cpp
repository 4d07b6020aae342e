// SPDX-License-Identifier: Apache-2.0
// Examples in the README agree with the command.
#include <filesystem>

#include "matchers.hpp"
#include "program.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

std::string source_file(const std::string& name) {
  return read_file((std::filesystem::path(AXISCAL_SOURCE_DIR) / name).string());
}

TEST(Readme, ShowsTheExampleAndTheConsumer) {
  const std::string readme = source_file("README.md");
  ASSERT_FALSE(readme.empty());
  const std::string example = source_file("examples/readme.cpp");
  EXPECT_THAT(readme, HasSubstr(example.substr(example.find("#include"))));
  const std::string consumer = source_file("tests/install/consumer/CMakeLists.txt");
  EXPECT_THAT(source_file("docs/library.md"),
              HasSubstr(consumer.substr(consumer.find("cmake_minimum"))));
}

// If an option has changed, run `axiscal --generate markdown > docs/options.md`.
TEST(Readme, OptionsAreThoseOfTheCommand) {
  EXPECT_EQ(source_file("docs/options.md"), run_axiscal({"--generate", "markdown"}).out);
}

TEST(Readme, ShowsWhatTheCommandPrints) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder.path("examples"));
  folder.write("examples/run.csv", source_file("examples/run.csv"));
  folder.write("log.csv", "time,x,y,z\n1,0.870,0.000,2.360\n");
  const std::string printable_text = source_file("docs/first_run.md");
  const auto shown = [&](const std::string& command) {
    const std::string shell = "cd '" + folder.path("") + "' && PATH='" +
                              std::filesystem::path(command_path()).parent_path().string() +
                              "':\"$PATH\" " + command + " > out.txt 2> err.txt";
    EXPECT_EQ(std::system(shell.c_str()), 0) << read_file(folder.path("err.txt"));
    EXPECT_THAT(printable_text,
                HasSubstr("$ " + command + "\n" + read_file(folder.path("out.txt"))));
  };
  shown(
      "axiscal calibrate examples/run.csv --instrument accelerometer --field gravity --unit V "
      "--serial QA-113 -o cal.json");
  shown("axiscal apply cal.json log.csv --decimals 6");
}

}  // namespace
}  // namespace axiscal::test
