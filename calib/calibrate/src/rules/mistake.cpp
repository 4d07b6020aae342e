// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/rules/rule.hpp"

namespace axiscal {
namespace {

void find_mistake(const JudgedRun& run, Warnings& found) {
  found.all.insert(found.all.end(), run.taken_in.begin(), run.taken_in.end());
  if (run.mistakes.culprit) {
    found.all.insert(found.all.end(), run.mistakes.culprit->warnings.begin(),
                     run.mistakes.culprit->warnings.end());
  }
}

}  // namespace

WarningRule mistake_rule() {
  return {.name = "mistake", .find = find_mistake};
}

}  // namespace axiscal
