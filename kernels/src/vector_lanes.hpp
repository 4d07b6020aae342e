// SPDX-License-Identifier: Apache-2.0
// What every vector kernel includes before Highway.
#pragma once

// A kernel is compiled once for each instruction set: for x86 SSE4, AVX2 and AVX-512, and what the
// compiler's own baseline is.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
