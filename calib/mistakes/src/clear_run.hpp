// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/small_run.hpp"

namespace axiscal {

/// Whether looks_bad() clearly says no of a small run: by the same tests, in closed form and to
/// first order. What is near any of their levels is not clear.
/// @param directions  whether the field's are fitted with the hypotheses.
[[nodiscard]] bool looks_clearly_good(const SmallState& run, bool directions);

}  // namespace axiscal
