// SPDX-License-Identifier: Apache-2.0
// The program that other_process.hpp starts.
#include "logs/recordings/src/other_process.hpp"

int main(int argc, char** argv) {
  return axiscal::answer_as_other_process(argc, argv);
}
