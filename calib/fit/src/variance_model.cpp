// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/variance_model.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "axiscal/calib/generalized_fit.hpp"
#include "axiscal/calib/mount_turns.hpp"
#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/rounding_scatter.hpp"
#include "scatter_components.hpp"
#include "soak_scatter.hpp"

namespace axiscal {
namespace {

void count_inputs_and_seats(ScatterSearch& search, Estimate& estimate) {
  search.weighed =
      weigh_shared_errors(search.experiment, search.fitted_state, search.method.method, estimate);
}

void count_mounts(ScatterSearch& search, Estimate& estimate) {
  search.mounts_known = search.mounts.size() > 1 &&
                        add_mount_scatter(search.mounts, search.mounts_expected, estimate);
}

bool is_transfer(const ScatterSearch& search) {
  return search.fitted.seen.cols() > 0;  // which knows nothing across its fields
}

void count_soaks(ScatterSearch& search, Estimate& estimate) {
  if (!is_transfer(search)) {
    add_soak_scatter(search.fitted, estimate);
  }
}

void count_rounding(ScatterSearch& search, Estimate& estimate) {
  add_rounding_scatter(search.fitted_state, search.experiment.stated.resolution, estimate);
}

void count_blocks(ScatterSearch& search, Estimate& estimate) {
  const std::optional<ProcessScatter>& earlier = search.experiment.process;
  add_block_scatter(search.judged, earlier ? &*earlier : nullptr, estimate);
}

void count_block_sensitivities(ScatterSearch& search, Estimate& estimate) {
  const std::vector<Reading>& readings = search.judged.readings;
  const bool several = std::any_of(readings.begin(), readings.end(), [&](const Reading& reading) {
    return reading.block != readings.front().block;
  });
  if (several && !is_transfer(search)) {
    search.gains_differ =
        add_block_sensitivities(search.run(estimate), search.mounts_known, estimate);
  }
}

void count_field_scatter(ScatterSearch& search, Estimate& estimate) {
  // Averages of opposite readings hide what is along the field.
  if (is_transfer(search) || search.method.averages_pairs) {
    return;
  }
  add_field_scatter(search.run(estimate), search.gains_differ, estimate);
}

void count_correlation(ScatterSearch& search, Estimate& estimate) {
  add_serial_correlation(search.judged_state(), estimate);
}

// Each cause has a small file of its own: the columns or weights that show it, its test, its words,
// its degrees of freedom. These change the fit itself;
constexpr std::array fitted_causes = {count_inputs_and_seats, count_mounts};
// these are looked for in what it leaves.
constexpr std::array causes = {count_soaks,         count_rounding,
                               count_blocks,        count_block_sensitivities,
                               count_field_scatter, count_correlation};

}  // namespace

void count_scatter(ScatterSearch& search, Estimate& estimate) {
  for (const auto count : fitted_causes) {
    count(search, estimate);
  }
  fill_intervals(estimate.statistics);
  if (!estimate.statistics.covariance.allFinite()) {
    return;
  }
  for (const auto count : causes) {
    count(search, estimate);
  }
}

}  // namespace axiscal
