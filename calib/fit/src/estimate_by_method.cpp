// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/estimate_by_method.hpp"

#include "axiscal/core/error.hpp"
#include "calib/fit/method_fit.hpp"
#include "calib/fit/temperature_fit.hpp"

namespace axiscal {
Estimate estimate_by(Method method, const ReadingSet& set, bool by_field) {
  const MethodFit& fit = method_fit(method);
  if (set.temperature.order == 0) {
    return fit.fitted(set, by_field);
  }
  ReadingSet without = set;
  without.temperature = {};
  return fit.fitted(initialize_temperature_terms(set, fit.fitted(without, by_field)), by_field);
}

std::vector<TemperatureOrderTrial> try_orders(Method method,
                                              const ReadingSource& source,
                                              const std::vector<FieldDescription>& parts,
                                              bool by_field) {
  constexpr int highest_order = 2;
  std::vector<TemperatureOrderTrial> trials;
  for (int order = 0; order <= highest_order; ++order) {
    const ReadingSet set = source.with({.temperature_order = order}).set(parts, {});
    if (order > 0 && temperature_count(set) <= order) {
      break;
    }
    try {
      trials.push_back(trial_of(set, estimate_by(method, set, by_field)));
    } catch (const RefusedError&) {
      if (order == 0) {
        throw;
      }
      break;  // the readings do not determine this many terms
    }
  }
  return trials;
}

}  // namespace axiscal
