// SPDX-License-Identifier: Apache-2.0
#include "commands.hpp"

namespace axiscal::cli {

int run(const AcquireCommand& /*command*/) {
  throw UsageError("acquire: this build has no data collector (AXISCAL_BUILD_ACQUISITION is off)");
}

}  // namespace axiscal::cli
