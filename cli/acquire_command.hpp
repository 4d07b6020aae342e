// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "acquire_options.hpp"
#include "axiscal/acquisition/source.hpp"

namespace axiscal::cli {

/// Opens the sources of --connect. @throws UsageError  if the option is missing or invalid.
[[nodiscard]] std::vector<std::unique_ptr<Source>> open_sources(const AcquireCommand& command);

/// Runs `acquire --check`: tests whether a live instrument has drifted. It takes readings of the
/// installed instrument until they suffice for a verdict.
[[nodiscard]] int run_health_check(const AcquireCommand& command);

}  // namespace axiscal::cli
