// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/core/export.hpp"

struct stat;  // POSIX, filled by fstat()

namespace axiscal {

/// While an InputProtection exists, no OutputFile replaces a file that InputFile has opened or that
/// an OutputFile has written.
///
/// A program that reads and writes files creates an InputProtection in main(). From then on, each
/// regular file that is opened for reading is remembered by device and inode, so that it is also
/// recognised by another name or a link. Each file that an OutputFile has written is remembered
/// too. Replacing such a file throws InputOverwriteError and changes no file. Without an
/// InputProtection no file is remembered: a user of the library may read a file, change the content
/// and write it again.
class AXISCAL_EXPORT InputProtection {
 public:
  InputProtection();
  ~InputProtection();
  InputProtection(const InputProtection&) = delete;
  InputProtection& operator=(const InputProtection&) = delete;
};

/// Remembers an open file as an input, as InputFile does. Call this function for files that are
/// opened without InputFile.
/// @param descriptor  an open file. It is ignored if it is not a regular file.
AXISCAL_EXPORT void protect_input(int descriptor);
AXISCAL_EXPORT void protect_input(const struct stat& status);

/// Checks that an output does not replace a remembered file.
/// @param path  the path of the output. If no file has this path, the check succeeds.
/// @throws InputOverwriteError  if this program has read or written the file.
AXISCAL_EXPORT void forbid_replacing_input(const std::string& path);

/// Checks that an open file that is written in place, such as standard output, is not a remembered
/// file.
/// @param descriptor  the open file.
/// @param name        the file's name in the message.
AXISCAL_EXPORT void forbid_replacing_input(int descriptor, const std::string& name);

/// Forgets a file that this program has written, so that the program can write it again. For
/// example, a session writes its results again at its end. A file that was read stays protected.
AXISCAL_EXPORT void allow_rewriting(const std::string& path);

/// Remembers a written file, so that a later output of the same name does not replace it.
AXISCAL_EXPORT void protect_output(int descriptor);

}  // namespace axiscal
