// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/estimate_by_method.hpp"

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/temperature_fit.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/field/settings.hpp"

namespace axiscal {
namespace {

// The field where every part's vector is known.
TableField known_field(const TableField& field) {
  for (const FieldDescription& part : field.parts()) {
    if (!part.in_table || part.free_length) {
      throw SetupError(formatted("field {}: give its vector in the table's frame", part.kind),
                       {settings::field_table});
    }
  }
  return field.as_stated();
}

Estimate by_method(Method method, const ReadingSet& set, bool by_field) {
  if (method == Method::joint) {
    return estimate_joint(set);
  }
  if (method_kind(method).averages_pairs) {
    const Eigen::Vector3d direction = known_field(set.field).vector(0).normalized();
    return estimate_paired(set, set.field.parts().front().magnitude * direction);
  }
  return estimate_known(set, by_field ? set.field : known_field(set.field));
}

}  // namespace

Estimate estimate_by(Method method, const ReadingSet& set, bool by_field) {
  if (set.temperature.order == 0) {
    return by_method(method, set, by_field);
  }
  ReadingSet without = set;
  without.temperature = {};
  return by_method(method, started_over_temperature(set, by_method(method, without, by_field)),
                   by_field);
}

std::vector<TemperatureOrderTrial> try_orders(Method method,
                                              ReadingSource& source,
                                              const std::vector<FieldDescription>& parts,
                                              bool by_field) {
  constexpr int highest_order = 2;
  std::vector<TemperatureOrderTrial> trials;
  for (int order = 0; order <= highest_order; ++order) {
    source.set_temperature(order, std::nullopt);
    const ReadingSet set = source.set(parts, {});
    if (order > 0 && temperature_count(set) <= order) {
      break;
    }
    try {
      trials.push_back(trial_of(set, estimate_by(method, set, by_field)));
    } catch (const RefusedError&) {
      if (order == 0) {
        throw;
      }
      break;  // the readings do not determine so many terms
    }
  }
  return trials;
}

}  // namespace axiscal
