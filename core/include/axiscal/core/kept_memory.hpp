// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/export.hpp"

namespace axiscal {

/// For a program, once, at its start, as the command does: memory that is freed is kept for what
/// comes next, up to 64 MB of it, instead of given back to the system and asked for anew. That
/// would cost half of the time of a run of 120 readings or of a recording, and a quarter of that of
/// 100,000 readings. Pieces of 8 MB or more are given back. It holds for all of the program; does
/// nothing where the C library is not glibc.
AXISCAL_EXPORT void keep_freed_memory();

}  // namespace axiscal
