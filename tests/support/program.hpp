// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace axiscal::test {

/// Exit status and output of a program.
struct ProgramResult {
  int status = 0;   ///< exit status; 128 + signal if a signal ended it
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

struct ProgramInput {
  std::string stdin_text;
  std::optional<std::size_t> file_size_limit;  ///< largest file [bytes] (RLIMIT_FSIZE)
  std::string stdout_path;                     ///< if set, the file for standard output
};

/// @return path of the command `axiscal`.
[[nodiscard]] std::string command_path();

/// Runs the command `axiscal` with these arguments.
[[nodiscard]] ProgramResult run_axiscal(const std::vector<std::string>& arguments,
                                        const ProgramInput& input = {});

/// A temporary folder that is removed at the end of the test.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] std::string path(const std::string& name) const { return (path_ / name).string(); }

  /// Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& content) const;

  /// @return the number of files in the folder.
  [[nodiscard]] std::size_t file_count() const;

 private:
  std::filesystem::path path_;
};

[[nodiscard]] std::string read_file(const std::string& path);

[[nodiscard]] nlohmann::json read_json(const std::string& path);

/// @return the cells of a CSV text without quotes. The first row is the header.
[[nodiscard]] std::vector<std::vector<std::string>> csv_cells(const std::string& text);

}  // namespace axiscal::test
