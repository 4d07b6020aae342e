// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "suspect_run.hpp"

namespace axiscal {

/// Whether a closer look is worth its time: by all axes alike, and by each in its own scatter.
[[nodiscard]] bool looks_bad(const SuspectRun& run);

/// Whether the readings contradict each other: nested F tests of what may have happened, for the
/// classes of mistakes together.
/// @param run  whose readings were left out one by one; on return two by two as well, and with axes
///             that count as they scatter where their noise clearly differs.
[[nodiscard]] bool is_bad(SuspectRun& run);

}  // namespace axiscal
