// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/causes/causes.hpp"

#include <utility>

#include "calib/record/parameter_names.hpp"

namespace axiscal {
namespace {

std::vector<Cause>& all_causes() {
  static std::vector<Cause> causes = {inputs_and_seats_cause(),
                                      mounts_cause(),
                                      soaks_cause(),
                                      rounding_cause(),
                                      poses_cause(),
                                      blocks_cause(),
                                      block_sensitivities_cause(),
                                      field_scatter_cause(),
                                      correlation_cause()};
  return causes;
}

}  // namespace

std::span<const Cause> causes_of_scatter() {
  return all_causes();
}

void add_cause(const Cause& cause) {
  all_causes().push_back(cause);
}

CountedEstimate count_scatter(const ScatterAnalysisInput& run, Estimate estimate) {
  CountedEstimate counted{.estimate = std::move(estimate), .weighed = {}};
  for (const Cause& cause : causes_of_scatter()) {
    if (cause.changes_fit) {
      counted = cause.counted(run, std::move(counted));
    }
  }
  fill_intervals(counted.estimate.statistics);
  if (!counted.estimate.statistics.covariance.allFinite()) {
    return counted;
  }
  for (const Cause& cause : causes_of_scatter()) {
    if (!cause.changes_fit) {
      counted = cause.counted(run, std::move(counted));
    }
  }
  return counted;
}

}  // namespace axiscal
