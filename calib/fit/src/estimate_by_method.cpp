// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/estimate_by_method.hpp"

#include <algorithm>
#include <limits>

#include "axiscal/calib/temperature_fit.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/rotation.hpp"

namespace axiscal {
namespace {

// ---- one-sided axes ----

// Light that grazes an axis's front by less than this part of its full response is not counted: the
// edge of a housing shades it, and noise must not decide.
constexpr double grazing = 0.05;

// A first guess: what reads clearly more than in the dark.
AxisMask lit_by_readings(const ReadingSet& set) {
  AxisMask lit = AxisMask::Constant(set.size(), set.axis_count(), true);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    double dark = std::numeric_limits<double>::infinity();
    double bright = -dark;
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      if (set.weights(i, k) > 0.0) {
        dark = std::min(dark, set.response(i, k));
        bright = std::max(bright, set.response(i, k));
      }
    }
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const bool is_dark_reading = set.readings[static_cast<std::size_t>(i)].level == 0.0;
      lit(i, k) = is_dark_reading || set.response(i, k) > dark + 2.0 * grazing * (bright - dark);
    }
  }
  return lit;
}

// What the fitted model says that an axis sees: all lamps in front of it, or none lit.
AxisMask lit_by_model(const ReadingSet& set,
                      const Estimate& estimate,
                      const std::vector<ResolvedPart>& parts) {
  AxisMask lit = AxisMask::Constant(set.size(), set.axis_count(), true);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Reading& reading = set.readings[at];
    std::vector<Eigen::Vector3d> lights;  // directions in the sensor
    if (reading.level == 0.0) {
      continue;
    }
    if (estimate.fields.empty()) {
      lights.emplace_back(reading.field_in_sensor->normalized());
    } else {
      const Eigen::Matrix3d& R = set.rotation_sensor_from_table[at];
      lights.emplace_back(R * set.field_in_table(i, estimate.fields).normalized());
      for (const Eigen::Vector3d& lamp : parts.front().lamps) {
        // The lamps as they were given, turned with their sum.
        const Eigen::Matrix3d turned =
            smallest_rotation(parts.front().part.in_table, estimate.fields.front());
        lights.emplace_back(R * (turned * lamp));
      }
    }
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      const Eigen::Vector3d S = estimate.response.sensitivity.row(k);
      lit(i, k) = std::all_of(lights.begin(), lights.end(), [&](const Eigen::Vector3d& light) {
        return S.dot(light) > grazing * S.norm();
      });
    }
  }
  return lit;
}

// ---- the methods ----

std::vector<FieldStart> starts_of(const std::vector<ResolvedPart>& parts) {
  std::vector<FieldStart> starts;
  double known = 0.0;  // a part of unknown size starts as large as the others
  for (const ResolvedPart& part : parts) {
    known = part.part.free_length ? known : std::max(known, part.part.magnitude);
  }
  for (const ResolvedPart& part : parts) {
    FieldStart start{.has_direction = part.has_value && part.has_heading, .sign_by = part.sign_by};
    start.value = (part.part.free_length ? known : part.part.magnitude) *
                  (part.has_value ? part.part.in_table.normalized() : Eigen::Vector3d::UnitZ());
    starts.push_back(start);
  }
  return starts;
}

std::vector<Eigen::Vector3d> values_of(const std::vector<ResolvedPart>& parts) {
  std::vector<Eigen::Vector3d> values;
  for (const ResolvedPart& part : parts) {
    if (!part.has_value || part.part.free_length) {
      throw SetupError(formatted("field {}: give its vector in the table's frame", part.part.kind),
                       {Setting::field_table});
    }
    values.push_back(part.part.in_table);
  }
  return values;
}

Estimate by_method(Method method,
                   const ReadingSet& set,
                   const std::vector<ResolvedPart>& parts,
                   bool by_field) {
  if (method == Method::joint) {
    return estimate_joint(set, starts_of(parts));
  }
  if (method == Method::paired) {
    const Eigen::Vector3d direction = values_of(parts).front().normalized();
    return estimate_paired(set, parts.front().part.magnitude * direction);
  }
  return estimate_known(set, by_field ? std::vector<Eigen::Vector3d>{} : values_of(parts));
}

}  // namespace

Estimate estimate_by(Method method,
                     const ReadingSet& set,
                     const std::vector<ResolvedPart>& parts,
                     bool by_field) {
  return fit_over_temperature(
      set, [&](const ReadingSet& own) { return by_method(method, own, parts, by_field); });
}

Estimate estimate_one_sided(Method method,
                            const ReadingSource& source,
                            const std::vector<ResolvedPart>& parts,
                            AxisMask& seen) {
  seen = lit_by_readings(source.set(parts, {}));
  Estimate estimate;
  std::vector<AxisMask> earlier;
  constexpr int most_rounds = 12;
  for (int round = 0; round < most_rounds; ++round) {
    const ReadingSet set = source.set(parts, seen);
    estimate = estimate_by(method, set, parts, source.by_field());
    const AxisMask next = lit_by_model(set, estimate, parts);
    if ((next == seen).all()) {
      return estimate;
    }
    const bool again = std::any_of(earlier.begin(), earlier.end(),
                                   [&](const AxisMask& mask) { return (mask == next).all(); });
    if (again) {
      break;
    }
    earlier.push_back(seen);
    seen = next;
  }
  estimate.unsettled = true;
  return estimate;
}

std::vector<TemperatureOrderTrial> try_orders(Method method,
                                              ReadingSource& source,
                                              const std::vector<ResolvedPart>& parts,
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
      trials.push_back(trial_of(set, estimate_by(method, set, parts, by_field)));
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
