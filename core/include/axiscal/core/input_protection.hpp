// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"

struct stat;  // POSIX: what fstat() says

namespace axiscal {

/// While one lives, no OutputFile replaces a file that InputFile has opened, or that was written.
///
/// A program that reads and writes files makes one in main(). From then on each regular file that
/// is opened for reading is known by device and inode, whatever name or link it was opened by, and
/// so is each file that an OutputFile has put into its place: to replace either throws
/// InputOverwriteError and changes nothing. Without one nothing is remembered: a library's user may
/// read a file, change what was in it and write it again.
class InputProtection {
 public:
  InputProtection();
  ~InputProtection();
  InputProtection(const InputProtection&) = delete;
  InputProtection& operator=(const InputProtection&) = delete;
};

/// Remembers an open file as an input, as InputFile does; for what is opened in another way.
/// @param descriptor  of the file; what is no regular file is not remembered.
AXISCAL_EXPORT void protect_input(int descriptor);
AXISCAL_EXPORT void protect_input(const struct stat& status);

/// @param path  of a file that is to be replaced; one that is not there is nobody's input.
/// @throws InputOverwriteError  if it was read as an input, or written before in this run.
AXISCAL_EXPORT void forbid_replacing_input(const std::string& path);

/// As forbid_replacing_input(), for an open file that is written to where it is (standard output).
/// @param name  for the message.
AXISCAL_EXPORT void forbid_replacing_input(int descriptor, const std::string& name);

/// Forgets a file that this run has written: it may be written anew, as a session's results at its
/// end. A file that was read stays an input.
AXISCAL_EXPORT void allow_rewriting(const std::string& path);

/// Remembers a file that was put into its place: the next output of that name would replace it.
AXISCAL_EXPORT void protect_output(int descriptor);

}  // namespace axiscal
