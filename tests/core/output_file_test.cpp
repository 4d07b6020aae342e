// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/output_file.hpp"

#include <csignal>
#include <filesystem>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/input_protection.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using test::read_file;
using test::ScratchFolder;

TEST(OutputFile, WritesItsStartAnew) {
  const ScratchFolder folder;
  const std::string path = folder.path("a.bin");
  OutputFile file(path);
  file.write("??? rows\n1\n2\n");
  file.rewrite_start("002");
  file.write("end");
  file.commit();
  EXPECT_EQ(read_file(path), "002 rows\n1\n2\nend");
}

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

// A file without write permission is not replaced, although its folder would allow it.
TEST(OutputFile, KeepsWhatIsProtected) {
  const ScratchFolder folder;
  const std::string path = folder.write("kept.csv", "old");
  std::filesystem::permissions(folder.path(""), std::filesystem::perms::all);
  std::filesystem::permissions(path, std::filesystem::perms::owner_read);
  const uid_t user = ::geteuid();
  constexpr uid_t nobody = 65534;
  if (user == 0 && ::seteuid(nobody) != 0) {
    GTEST_SKIP() << "root may write anything, and cannot become another";
  }
  EXPECT_THROW(write_whole_file(path, "new"), OutputError);
  if (user == 0) {
    ASSERT_EQ(::seteuid(user), 0);
  }
  EXPECT_EQ(read_file(path), "old");
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

TEST(OutputFile, LeavesNothingWhenItsProcessIsKilled) {
  const ScratchFolder folder;
  const std::string path = folder.write("a.txt", "old");
  const pid_t child = ::fork();
  if (child == 0) {
    OutputFile file(path);
    file.write("half of the ne");
    ::raise(SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(read_file(path), "old");
  EXPECT_EQ(folder.file_count(), 1U) << "a file without a name is gone with its process";
}

TEST(OutputFile, RemovesWhatKilledRunsLeft) {
  // The process has ended, so its number is free until another process gets it.
  const pid_t gone = ::fork();
  if (gone == 0) {
    ::_exit(0);
  }
  ::waitpid(gone, nullptr, 0);
  const ScratchFolder folder;
  const std::string orphan = folder.write(".axiscal-" + std::to_string(gone) + "-0", "left");
  const std::string alive = folder.write(".axiscal-" + std::to_string(::getppid()) + "-0", "");
  const std::string foreign = folder.write(".axiscal-notes", "the user's");
  const std::string locked = folder.write(".axiscal-" + std::to_string(gone) + "-1", "");
  const int held = ::open(locked.c_str(), O_RDONLY);
  ASSERT_EQ(::flock(held, LOCK_EX | LOCK_NB), 0);
  write_whole_file(folder.path("a.txt"), "new");
  EXPECT_FALSE(std::filesystem::exists(orphan));
  EXPECT_TRUE(std::filesystem::exists(alive)) << "its process lives";
  EXPECT_TRUE(std::filesystem::exists(foreign)) << "none of ours";
  EXPECT_TRUE(std::filesystem::exists(locked)) << "somebody writes it, in another container say";
  ::close(held);
}

TEST(InputProtection, KeepsWhatWasReadAndWhatWasWritten) {
  const ScratchFolder folder;
  const std::string input = folder.write("in.txt", "input");
  std::filesystem::create_symlink("in.txt", folder.path("link.txt"));
  std::filesystem::create_hard_link(input, folder.path("twin.txt"));
  {
    const InputProtection protection;
    EXPECT_EQ(read_whole_file(folder.path("link.txt")), "input");
    for (const char* name : {"in.txt", "link.txt", "twin.txt"}) {
      EXPECT_THROW(write_whole_file(folder.path(name), "x"), InputOverwriteError) << name;
      EXPECT_THROW(OutputFile(folder.path(name), OutputFile::Mode::direct), InputOverwriteError);
      EXPECT_THROW(forbid_replacing_input(folder.path(name)), InputOverwriteError);
    }
    EXPECT_EQ(read_file(input), "input");
    write_whole_file(folder.path("out.txt"), "one");
    EXPECT_THROW(write_whole_file(folder.path("out.txt"), "two"), InputOverwriteError);
    EXPECT_EQ(read_file(folder.path("out.txt")), "one");
    // The file is read while it is being written. commit() checks this again.
    folder.write("late.txt", "late");
    OutputFile late(folder.path("late.txt"));
    late.write("x");
    EXPECT_EQ(read_whole_file(folder.path("late.txt")), "late");
    EXPECT_THROW(late.commit(), InputOverwriteError);
  }
  write_whole_file(input, "changed");
  EXPECT_EQ(read_file(input), "changed") << "a library's user may write what was read";
}

TEST(InputFile, HasLimits) {
  const std::string endless = "/dev/zero";
  EXPECT_THAT(test::complaint_of<DataError>([&] { static_cast<void>(read_whole_file(endless)); }),
              testing::HasSubstr("256 MiB"));
  EXPECT_THAT(
      test::complaint_of<DataError>([&] { for_each_line(endless, [](std::string_view, bool) {}); }),
      testing::HasSubstr("/dev/zero:1: a line of more than 1 MiB"));
  const ScratchFolder folder;
  std::vector<std::pair<std::string, bool>> lines;
  for_each_line(folder.write("a", "one\n\nthr"),
                [&](std::string_view line, bool whole) { lines.emplace_back(line, whole); });
  EXPECT_EQ(lines,
            (std::vector<std::pair<std::string, bool>>{{"one", true}, {"", true}, {"thr", false}}));
}

TEST(InputFile, RefusesWhatCannotBeRead) {
  const ScratchFolder folder;
  EXPECT_THROW(static_cast<void>(read_whole_file(folder.path("none"))), DataError);
  EXPECT_THROW(static_cast<void>(read_whole_file(folder.path(""))), DataError);
  EXPECT_EQ(read_whole_file(folder.write("a", "text")), "text");
}

}  // namespace
}  // namespace axiscal
