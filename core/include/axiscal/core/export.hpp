// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks a class or function that libaxiscal.so exports (BUILD_SHARED_LIBS). The other symbols of
/// the library are hidden.
#if defined(__GNUC__)
#define AXISCAL_EXPORT __attribute__((visibility("default")))
#else
#define AXISCAL_EXPORT
#endif
