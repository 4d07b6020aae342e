// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "axiscal/core/export.hpp"

namespace axiscal {

/// An output file that is either replaced completely or not changed.
///
/// If the target is a regular file, the content is first written to another file in its folder.
/// That file has no name if the system supports this (O_TMPFILE), otherwise a temporary name.
/// commit() flushes it to the disk and gives it the target's name. Without commit() the target does
/// not change. Symbolic links are followed. Other targets (`/dev/null`, a pipe, `-` for standard
/// output) are written directly. Temporary files that a killed process left in the folder are
/// removed; their names contain the process id. While an InputProtection exists, files that were
/// read as input are not replaced.
class AXISCAL_EXPORT OutputFile {
 public:
  enum class Mode {
    replace_whole,  ///< commit() replaces the target, see OutputFile
    direct,         ///< for endless output: the file is emptied, then written directly
  };

  /// @throws OutputError          if the folder is missing or cannot be written to.
  /// @throws InputOverwriteError  if forbid_replacing_input() throws it.
  explicit OutputFile(std::string path, Mode mode = Mode::replace_whole);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// @return true if the target is written directly, so that the text cannot be taken back.
  [[nodiscard]] bool is_direct() const { return target_.empty(); }

  /// @throws OutputError  if the file cannot be written, for example because the disk is full. The
  ///                      error is a ClosedPipe if the reading process has closed the pipe.
  void write(std::string_view text);

  /// Overwrites the start of the file with `text`, which must not be longer than the file.
  /// @throws OutputError  if the target is not a regular file, for example a pipe.
  void rewrite_start(std::string_view text);

  /// Moves the file to the target path. Do not call write() afterwards.
  /// @throws OutputError          for the same reasons as write().
  /// @throws InputOverwriteError  if forbid_replacing_input() throws it.
  void commit();

 private:
  [[noreturn]] void fail(std::string_view action) const;
  void discard() noexcept;
  [[nodiscard]] std::filesystem::path folder() const;
  void open_unnamed();
  void open_beside();
  template <typename Make>
  bool make_temporary(const Make& make);

  std::string path_;
  std::string target_;     // path_ with links resolved; empty if is_direct() or after commit()
  std::string temporary_;  // path next to target_; empty while the file is unnamed
  int descriptor_ = -1;
  std::size_t written_ = 0;
  std::size_t handed_to_disk_ = 0;
};

/// Writes a file completely or not at all. If the process that reads standard output has closed the
/// pipe, the function does not throw, so that the exit status does not change.
/// @throws OutputError, InputOverwriteError  for the same reasons as OutputFile.
AXISCAL_EXPORT void write_whole_file(const std::string& path, std::string_view content);

/// Removes the temporary files of unfinished OutputFiles; may be called from a signal handler.
AXISCAL_EXPORT void remove_unfinished_output() noexcept;

}  // namespace axiscal
