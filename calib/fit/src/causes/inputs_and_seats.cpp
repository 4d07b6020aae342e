// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "calib/fit/generalized_fit.hpp"
#include "calib/fit/src/causes/causes.hpp"

namespace axiscal {
namespace {

CountedEstimate counted_inputs_and_seats(const ScatterAnalysisInput& run, CountedEstimate so_far) {
  so_far.weighed =
      weigh_shared_errors(run.experiment, run.fitted, run.method.method, so_far.estimate);
  // The readings of a laying share the rotation of its seat.
  so_far.means_counted = so_far.estimate.statistics.find_component("seats") != nullptr;
  return so_far;
}

}  // namespace

Cause inputs_and_seats_cause() {
  return {.name = "inputs_and_seats", .changes_fit = true, .counted = counted_inputs_and_seats};
}

}  // namespace axiscal
