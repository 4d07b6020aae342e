// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/own_program.hpp"

namespace axiscal {

/// A program that runs in a separate process, connected by a pipe.
class ChildProgram {
 public:
  /// The standard stream of the program that is connected to the pipe.
  enum class Pipe { standard_input, standard_output };

  struct Streams {
    Pipe pipe = Pipe::standard_output;
    /// The file that the program reads as its standard input. If empty, the program reads the pipe
    /// or inherits the standard input of this process.
    std::string input_file;
    bool hides_errors = false;  ///< true: the program's standard error is discarded
  };

  /// Starts the program.
  /// @param arguments  the arguments after the program's name.
  /// @throws RefusedError  if the program is not installed or cannot be started.
  ChildProgram(const OwnProgram& program,
               const std::vector<std::string>& arguments,
               const Streams& streams);
  /// Closes the pipe and waits for the program's end.
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  /// Writes to the standard input of the program.
  /// @return false if the program has ended.
  [[nodiscard]] bool write(std::string_view bytes) const;

  /// Reads from the standard output of the program.
  /// @return the number of bytes; 0 at the end.
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size) const;

  /// @return the rest of the program's standard output.
  [[nodiscard]] std::string read_all() const;

  /// Closes the pipe and waits for the end of the program.
  /// @return the program's exit status, encoded as by waitpid().
  int wait();

 private:
  int pid_ = -1;
  int pipe_ = -1;
  int status_ = 0;
};

}  // namespace axiscal
