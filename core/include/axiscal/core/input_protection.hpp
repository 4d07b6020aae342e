// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"

struct stat;  // POSIX: st_dev and st_ino of fstat()

namespace axiscal {

/// While one lives, no OutputFile replaces a file that InputFile has opened, or that was written.
///
/// A program that reads and writes files creates one in main(). Afterwards each regular file that
/// is opened for reading is remembered by device and inode, under any name or link, and so is each
/// file that an OutputFile has put into place. Replacing such a file throws InputOverwriteError and
/// changes no file. Without an InputProtection no file is remembered: a user of the library may
/// read a file, change the content and write it again.
class AXISCAL_EXPORT InputProtection {
 public:
  InputProtection();
  ~InputProtection();
  InputProtection(const InputProtection&) = delete;
  InputProtection& operator=(const InputProtection&) = delete;
};

/// Remembers an open file as an input, as InputFile does. Use it for files that are opened in
/// another way.
/// @param descriptor  of the file. Files that are not regular are not remembered.
AXISCAL_EXPORT void protect_input(int descriptor);
AXISCAL_EXPORT void protect_input(const struct stat& status);

/// @param path  of a file that is to be replaced; one that is not there is nobody's input.
/// @throws InputOverwriteError  if it was read as an input, or written before in this run.
AXISCAL_EXPORT void forbid_replacing_input(const std::string& path);

/// As forbid_replacing_input(), for an open file that is written to where it is (standard output).
/// @param name  for the message.
AXISCAL_EXPORT void forbid_replacing_input(int descriptor, const std::string& name);

/// Forgets a file that this run has written, so that it can be written again, as the results of a
/// session are at its end. A file that was read stays an input.
AXISCAL_EXPORT void allow_rewriting(const std::string& path);

/// Remembers a file that was put into its place: the next output of that name would replace it.
AXISCAL_EXPORT void protect_output(int descriptor);

}  // namespace axiscal
