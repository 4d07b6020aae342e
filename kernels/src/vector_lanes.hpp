// SPDX-License-Identifier: Apache-2.0
// What every vector kernel includes before Highway.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

// A kernel is compiled once for each instruction set: for x86 SSE4, AVX2, AVX-512 and the
// compiler's baseline.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)

// A table of kernels by instruction set, and the call. HWY_EXPORT and HWY_DYNAMIC_DISPATCH do this
// with libhwy, but libhwy measures the processor for five milliseconds at every start.
#define AXISCAL_KERNEL(FUNCTION)                                                \
  static decltype(&HWY_STATIC_DISPATCH(FUNCTION)) const FUNCTION##Kernels[] = { \
      HWY_CHOOSE_TARGET_LIST(FUNCTION), HWY_CHOOSE_FALLBACK(FUNCTION)}
#define AXISCAL_CALL(FUNCTION) (*FUNCTION##Kernels[axiscal::chosen_kernel()])

namespace axiscal {

/// @return the place in a kernel's table of the instruction set that kernels run on.
[[nodiscard]] std::size_t chosen_kernel();

/// Numbers that begin where a vector of any instruction set may.
inline constexpr std::align_val_t vector_alignment{64};
struct DeleteAligned {
  void operator()(double* values) const { ::operator delete(values, vector_alignment); }
};
using AlignedValues = std::unique_ptr<double[], DeleteAligned>;

/// @return so many, not set.
[[nodiscard]] inline AlignedValues aligned_values(std::size_t count) {
  return AlignedValues(
      static_cast<double*>(::operator new(count * sizeof(double), vector_alignment)));
}

}  // namespace axiscal
