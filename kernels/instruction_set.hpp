// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// @return the instruction set that the kernels use: "AVX3" (AVX-512), "AVX2", "SSE4", "NEON", ...,
///         or "plain" if they were built without Highway.
[[nodiscard]] std::string instruction_set();

/// @return the instruction sets that the kernels can use on this machine, best first.
[[nodiscard]] std::vector<std::string> instruction_sets();

/// Selects one of instruction_sets() for the kernels, for tests and benchmarks. Call it before
/// other threads use kernels. An empty name selects the best one.
/// @return false if there is no instruction set of that name.
bool use_instruction_set(std::string_view name);

}  // namespace axiscal
