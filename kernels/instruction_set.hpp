// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axiscal {

/// @return the instruction set that the kernels run on: "AVX3" (AVX-512), "AVX2", "SSE4", "NEON",
///         ..., "plain" where they were built without Highway.
[[nodiscard]] std::string instruction_set();

/// @return those that the kernels could run on here, best first.
[[nodiscard]] std::vector<std::string> instruction_sets();

/// Makes the kernels run on another of instruction_sets(): for tests and benchmarks, before other
/// threads use them. An empty name takes the best again.
/// @return whether there is one of that name.
bool use_instruction_set(std::string_view name);

}  // namespace axiscal
