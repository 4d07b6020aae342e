// SPDX-License-Identifier: Apache-2.0
// Every vector kernel includes this file before Highway.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

// A kernel is compiled once for each instruction set. On x86 these are SSE4, AVX2, AVX-512 and the
// compiler's baseline.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)

// AXISCAL_KERNEL defines a table with one version of a kernel for each instruction set.
// AXISCAL_CALL calls the version for the chosen instruction set. Highway's own HWY_EXPORT and
// HWY_DYNAMIC_DISPATCH are not used, because they need libhwy. That library measures the processor
// for five milliseconds at every start.
#define AXISCAL_KERNEL(FUNCTION)                                                \
  static decltype(&HWY_STATIC_DISPATCH(FUNCTION)) const FUNCTION##Kernels[] = { \
      HWY_CHOOSE_TARGET_LIST(FUNCTION), HWY_CHOOSE_FALLBACK(FUNCTION)}
#define AXISCAL_CALL(FUNCTION) (*FUNCTION##Kernels[axiscal::chosen_kernel()])

namespace axiscal {

/// @return the index of the current instruction set in the tables of AXISCAL_KERNEL.
[[nodiscard]] std::size_t chosen_kernel();

/// An alignment [bytes] that is sufficient for the vectors of every instruction set.
inline constexpr std::align_val_t vector_alignment{64};
struct DeleteAligned {
  void operator()(double* values) const { ::operator delete(values, vector_alignment); }
};
using AlignedValues = std::unique_ptr<double[], DeleteAligned>;

/// @return `count` numbers that are not initialised, aligned to vector_alignment.
[[nodiscard]] inline AlignedValues aligned_values(std::size_t count) {
  return AlignedValues(
      static_cast<double*>(::operator new(count * sizeof(double), vector_alignment)));
}

}  // namespace axiscal
