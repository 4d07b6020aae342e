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
      const bool is_dark_reading =
          set.field.is_dark(set.readings[static_cast<std::size_t>(i)].level);
      lit(i, k) = is_dark_reading || set.response(i, k) > dark + 2.0 * grazing * (bright - dark);
    }
  }
  return lit;
}

// Directions in the sensor of all that shines at a reading: each part that is on, by its lamps
// where they were given.
std::vector<Eigen::Vector3d> lights_of(const ReadingSet& set,
                                       std::size_t reading,
                                       const TableField& field) {
  const FieldLevel& level = set.readings[reading].level;
  const Eigen::Matrix3d& R = set.rotation_sensor_from_table[reading];
  std::vector<Eigen::Vector3d> lights;
  for (std::size_t p = 0; p < field.parts().size(); ++p) {
    const double factor = field.factor_of(p, level);
    const Eigen::Vector3d vector = field.vector(field.is_sum() ? p : set.tilt_of(reading));
    if (factor == 0.0 || !(vector.norm() > 0.0)) {
      continue;
    }
    const Eigen::Vector3d met =
        set.field_then.empty() ? vector : Eigen::Vector3d(set.field_then[reading] * vector);
    lights.emplace_back(R * (factor * met).normalized());
    for (const Eigen::Vector3d& lamp : field.parts()[p].start.lamps) {
      // The lamps as they were given, turned with their sum.
      lights.emplace_back(R * (smallest_rotation(*field.parts()[p].in_table, vector) * lamp));
    }
  }
  return lights;
}

// What the fitted model says that an axis sees: all that shines is in front of it, or nothing does.
AxisMask lit_by_model(const ReadingSet& set, const Estimate& estimate) {
  AxisMask lit = AxisMask::Constant(set.size(), set.axis_count(), true);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Reading& reading = set.readings[at];
    std::vector<Eigen::Vector3d> lights;
    if (estimate.field.has_vectors()) {
      lights = lights_of(set, at, estimate.field);
    } else if (!set.field.is_dark(reading.level)) {
      lights.emplace_back(reading.field_in_sensor->normalized());
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

// The field where every part's vector is known.
TableField known_field(const TableField& field) {
  for (const FieldDescription& part : field.parts()) {
    if (!part.in_table || part.free_length) {
      throw SetupError(formatted("field {}: give its vector in the table's frame", part.kind),
                       {Setting::field_table});
    }
  }
  return field.as_stated();
}

Estimate by_method(Method method, const ReadingSet& set, bool by_field) {
  if (method == Method::joint) {
    return estimate_joint(set);
  }
  if (method == Method::paired) {
    const Eigen::Vector3d direction = known_field(set.field).vector(0).normalized();
    return estimate_paired(set, set.field.parts().front().magnitude * direction);
  }
  return estimate_known(set, by_field ? set.field : known_field(set.field));
}

}  // namespace

Estimate estimate_by(Method method, const ReadingSet& set, bool by_field) {
  return fit_over_temperature(
      set, [&](const ReadingSet& own) { return by_method(method, own, by_field); });
}

Estimate estimate_one_sided(Method method,
                            const ReadingSource& source,
                            const std::vector<FieldDescription>& parts,
                            AxisMask& seen) {
  seen = lit_by_readings(source.set(parts, {}));
  Estimate estimate;
  std::vector<AxisMask> earlier;
  constexpr int most_rounds = 12;
  for (int round = 0; round < most_rounds; ++round) {
    const ReadingSet set = source.set(parts, seen);
    estimate = estimate_by(method, set, source.by_field());
    const AxisMask next = lit_by_model(set, estimate);
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
