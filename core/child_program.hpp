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
    std::string input_file;     ///< standard input; empty: the pipe, or that of this process
    bool hides_errors = false;  ///< true: standard error is discarded
  };

  /// Starts the program.
  /// @param arguments  the arguments after the program's name.
  /// @throws RefusedError  if it is not installed or cannot be started.
  ChildProgram(const OwnProgram& program,
               const std::vector<std::string>& arguments,
               const Streams& streams);
  /// Closes the pipe and waits for the program's end.
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  /// Writes to its standard input.
  /// @return false if the program has ended.
  [[nodiscard]] bool write(std::string_view bytes) const;

  /// Reads from its standard output.
  /// @return the number of bytes; 0 at the end.
  [[nodiscard]] std::size_t read(char* buffer, std::size_t size) const;

  /// @return the rest of its standard output.
  [[nodiscard]] std::string read_all() const;

  /// Closes the pipe and waits for the end of the program.
  /// @return its status in the form of waitpid().
  int wait();

 private:
  int pid_ = -1;
  int pipe_ = -1;
  int status_ = 0;
};

}  // namespace axiscal
