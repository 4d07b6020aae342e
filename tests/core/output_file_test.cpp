// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/output_file.hpp"

#include <filesystem>

#include <sys/stat.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using test::read_file;
using test::ScratchFolder;

TEST(OutputFile, LeavesTheOldFileUntilCommitted) {
  const ScratchFolder folder;
  const std::string path = folder.write("a.txt", "old");
  {
    OutputFile file(path);
    file.write("half of the ne");
    EXPECT_EQ(read_file(path), "old");
  }
  EXPECT_EQ(read_file(path), "old");
  EXPECT_EQ(folder.file_count(), 1U);
  write_whole_file(path, "new");
  EXPECT_EQ(read_file(path), "new");
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(OutputFile, FollowsLinksAndKeepsPermissions) {
  const ScratchFolder folder;
  const std::string target = folder.write("target.txt", "old");
  ::chmod(target.c_str(), 0640);
  std::filesystem::create_symlink("target.txt", folder.path("link.txt"));
  write_whole_file(folder.path("link.txt"), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("link.txt")));
  EXPECT_EQ(read_file(target), "new");
  struct stat status {};
  ::stat(target.c_str(), &status);
  EXPECT_EQ(status.st_mode & 0777U, 0640U);
}

TEST(OutputFile, RefusesWhereNothingCanBeWritten) {
  const ScratchFolder folder;
  EXPECT_THROW(write_whole_file(folder.path("no/such/folder.txt"), "x"), OutputError);
  EXPECT_THROW(write_whole_file(folder.path(""), "x"), OutputError);
  EXPECT_THROW(write_whole_file("/dev/full", "x"), OutputError);
}

TEST(OutputFile, RefusesALoopOfLinksAndTakesLongNames) {
  const ScratchFolder folder;
  std::filesystem::create_symlink("b", folder.path("a"));
  std::filesystem::create_symlink("a", folder.path("b"));
  EXPECT_THROW(write_whole_file(folder.path("a"), "x"), OutputError);
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("a")));
  const std::string long_name = folder.path(std::string(250, 'n'));
  write_whole_file(long_name, "x");
  EXPECT_EQ(read_file(long_name), "x");
}

TEST(OutputFile, WritesToDevicesDirectly) {
  write_whole_file("/dev/null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(InputFile, RefusesWhatCannotBeRead) {
  const ScratchFolder folder;
  EXPECT_THROW(static_cast<void>(read_whole_file(folder.path("none"))), DataError);
  EXPECT_THROW(static_cast<void>(read_whole_file(folder.path(""))), DataError);
  EXPECT_EQ(read_whole_file(folder.write("a", "text")), "text");
}

}  // namespace
}  // namespace axiscal
