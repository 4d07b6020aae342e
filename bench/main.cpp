// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include "axiscal/core/kept_memory.hpp"

int main(int argc, char** argv) {
  axiscal::keep_freed_memory();  // the command axiscal does the same
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) {
    return 1;
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
