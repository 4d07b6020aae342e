// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/variance_model.hpp"

#include <array>

#include "axiscal/calib/parameter_names.hpp"
#include "axiscal/calib/rounding_scatter.hpp"
#include "scatter_components.hpp"
#include "soak_scatter.hpp"

namespace axiscal {
namespace {

bool is_transfer(const ScatterSearch& search) {
  return search.fitted.seen.cols() > 0;  // which knows nothing across its fields
}

void count_soaks(ScatterSearch& search, Estimate& estimate) {
  if (!is_transfer(search)) {
    add_soak_scatter(search.fitted, estimate);
  }
}

void count_rounding(ScatterSearch& search, Estimate& estimate) {
  add_rounding_scatter(search.fitted, search.method.directions_known, search.stated_step, estimate);
}

void count_blocks(ScatterSearch& search, Estimate& estimate) {
  add_block_scatter(search.judged, search.process, estimate);
}

void count_block_sensitivities(ScatterSearch& search, Estimate& estimate) {
  if (!is_transfer(search)) {
    search.gains_differ =
        add_block_sensitivities(search.run(estimate), search.mounts_known, estimate);
  }
}

// Averages of opposite readings hide what is along the field.
bool looks_along_field(const ScatterSearch& search) {
  return !is_transfer(search) && !search.method.averages_pairs;
}

void count_field_noise(ScatterSearch& search, Estimate& estimate) {
  // Gains that differ between blocks look like noise along the field.
  if (looks_along_field(search) && !search.gains_differ) {
    add_field_noise(search.run(estimate), estimate);
  }
}

void count_field_wander(ScatterSearch& search, Estimate& estimate) {
  if (looks_along_field(search)) {
    add_field_wander(search.run(estimate), search.gains_differ, estimate);
  }
}

void count_correlation(ScatterSearch& search, Estimate& estimate) {
  add_serial_correlation(search.judged, estimate);
}

// Each has a small file of its own: the columns or weights that show it, its test, its words, its
// degrees of freedom.
constexpr std::array causes = {
    count_soaks,       count_rounding,     count_blocks,     count_block_sensitivities,
    count_field_noise, count_field_wander, count_correlation};

}  // namespace

void count_scatter(ScatterSearch& search, Estimate& estimate) {
  fill_intervals(estimate.statistics);
  if (!estimate.statistics.covariance.allFinite()) {
    return;
  }
  for (const auto count : causes) {
    count(search, estimate);
  }
}

}  // namespace axiscal
