// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/estimate_by_method.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "axiscal/calib/temperature_fit.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/settings.hpp"

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

// ---- one-sided axes under a light that stays on beside others ----

// What the axes see of each part, and which readings count for them.
struct Sight {
  std::vector<AxisMask> visible;  // n x m, of each part
  AxisMask counted;               // n x m: no light is at the edge of an axis's view

  friend bool operator==(const Sight& a, const Sight& b) {
    if ((a.counted != b.counted).any()) {
      return false;
    }
    for (std::size_t p = 0; p < a.visible.size(); ++p) {
      if ((a.visible[p] != b.visible[p]).any()) {
        return false;
      }
    }
    return true;
  }
};

Sight everything(const ReadingSet& set) {
  const AxisMask all = AxisMask::Constant(set.size(), set.axis_count(), true);
  return {.visible = std::vector<AxisMask>(set.field.parts().size(), all), .counted = all};
}

// Whether nothing that can be set is on.
bool is_constant_light_alone(const ReadingSet& set, std::size_t reading) {
  const std::vector<FieldDescription>& parts = set.field.parts();
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (parts[p].set_by_level && set.field.factor_of(p, set.readings[reading].level) != 0.0) {
      return false;
    }
  }
  return true;
}

// A first guess by the readings alone: the light that stays is what differs between poses where
// nothing else is on, the lights that are set are what a pose reads more with them.
Sight sight_by_readings(const ReadingSet& set) {
  Sight sight = everything(set);
  const std::vector<FieldDescription>& parts = set.field.parts();
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    std::map<DesignPoint, double> constant;  // what each pose reads of it
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (is_constant_light_alone(set, at)) {
        constant[*set.readings[at].point] = set.response(i, k);
      }
    }
    if (constant.empty()) {
      throw SetupError(
          "one-sided axes under a light that stays on beside one that is set: no reading is with "
          "that light off (level 0), so that nothing tells them apart; take each point with it on "
          "and off, or darken the room, so that it is the only one");
    }
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const auto& [point, value] : constant) {
      least = std::min(least, value);
      most = std::max(most, value);
    }
    double brightest = 0.0;
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const auto own = constant.find(*set.readings[static_cast<std::size_t>(i)].point);
      if (own != constant.end()) {
        brightest = std::max(brightest, set.response(i, k) - own->second);
      }
    }
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const auto own = constant.find(*set.readings[static_cast<std::size_t>(i)].point);
      sight.counted(i, k) = own != constant.end();
      for (std::size_t p = 0; p < parts.size() && own != constant.end(); ++p) {
        sight.visible[p](i, k) = parts[p].set_by_level
                                     ? set.response(i, k) - own->second > 2.0 * grazing * brightest
                                     : own->second > least + 2.0 * grazing * (most - least);
      }
    }
  }
  return sight;
}

// What the fitted model says: a part is in front of an axis, or behind it; a reading with one at
// the edge of the axis's view does not count. A light that no axis can tell from noise is anywhere.
Sight sight_by_model(const ReadingSet& set, const Estimate& estimate) {
  Sight sight = everything(set);
  for (std::size_t p = 0; p < set.field.parts().size(); ++p) {
    const Eigen::Vector3d& light = estimate.field.vector(p);
    for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
      const Eigen::RowVector3d S = estimate.response.sensitivity.row(k);
      constexpr double clear = 3.0;  // standard deviations of a reading
      if (!(S.norm() * light.norm() > clear * estimate.statistics.residual_sd(k))) {
        continue;
      }
      for (Eigen::Index i = 0; i < set.size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (set.field.factor_of(p, set.readings[at].level) == 0.0) {
          continue;
        }
        const double share =
            S.normalized().dot(set.rotation_sensor_from_table[at] * light.normalized());
        sight.visible[p](i, k) = share > 0.0;
        sight.counted(i, k) = sight.counted(i, k) && std::abs(share) > grazing;
      }
    }
  }
  return sight;
}

// ---- the methods ----

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

namespace {

// Under a light that stays on: each axis sees its own parts of what is on, by the fitted model,
// until it stays.
Estimate estimate_under_constant_light(Method method,
                                       const ReadingSource& source,
                                       const std::vector<FieldDescription>& parts,
                                       AxisMask& seen) {
  Sight sight = sight_by_readings(source.set(parts, {}));
  Estimate estimate;
  constexpr int most_rounds = 20;
  for (int round = 0; round < most_rounds; ++round) {
    ReadingSet set = source.set(parts, sight.counted);
    set.visible = sight.visible;
    try {
      estimate = estimate_by(method, set, source.by_field());
    } catch (const RankDeficientError& error) {
      throw SetupError(
          formatted("one-sided axes under a light that stays on beside one that is set: these "
                    "readings do not tell what each axis sees of which ({}); darken the room, so "
                    "that the light that is set is the only one, or take all 24 points, each with "
                    "that light on and off",
                    error.what()));
    }
    estimate.visible = sight.visible;
    seen = sight.counted;
    Sight next = sight_by_model(set, estimate);
    if (next == sight) {
      return estimate;
    }
    sight = std::move(next);
  }
  estimate.unsettled = true;
  return estimate;
}

}  // namespace

Estimate estimate_one_sided(Method method,
                            const ReadingSource& source,
                            const std::vector<FieldDescription>& parts,
                            AxisMask& seen) {
  const bool stays_on = parts.size() > 1 && !source.by_field() &&
                        std::any_of(parts.begin(), parts.end(), [](const FieldDescription& part) {
                          return !part.set_by_level;
                        });
  if (stays_on) {
    return estimate_under_constant_light(method, source, parts, seen);
  }
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
