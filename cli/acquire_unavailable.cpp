// SPDX-License-Identifier: Apache-2.0
#include "acquire_options.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {

int run_acquire(const AcquireCommand& /*command*/) {
  throw UsageError("acquire: this build has no data collector (AXISCAL_BUILD_ACQUISITION is off)");
}

}  // namespace axiscal::cli
