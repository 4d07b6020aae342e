// SPDX-License-Identifier: Apache-2.0
// Axes that see a field from one side only, as a photodiode does (method.md, section 4).
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/estimate_by_method.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// If the response to the light is less than this fraction of an axis's full response, the axis does
// not use the reading. At such angles, the edge of a housing may shade the axis. Without this
// limit, noise could also decide whether the reading is used.
constexpr double grazing = 0.05;

// The readings that each axis uses, and the lights that it sees.
struct Sight {
  AxisMask counted;  // n x m: true if the axis uses the reading
  // n x m for each part of the field: true if the axis sees this light. Empty if no light stays on.
  std::vector<AxisMask> visible;

  friend bool operator==(const Sight& a, const Sight& b) {
    const auto same = [](const AxisMask& x, const AxisMask& y) { return (x == y).all(); };
    return same(a.counted, b.counted) &&
           std::equal(a.visible.begin(), a.visible.end(), b.visible.begin(), same);
  }
};

// Returns true if a part of the field is a light that stays on. The level of a reading does not set
// the strength of this light, and the field has other lights.
bool stays_on(const ReadingSet& set, std::size_t part) {
  return set.field.is_sum() && !set.rotation_sensor_from_table.empty() &&
         !set.field.parts()[part].set_by_level;
}

// Returns true if all lights that can be switched are off.
bool is_as_dark_as_can_be(const ReadingSet& set, std::size_t reading) {
  for (std::size_t p = 0; p < set.field.parts().size(); ++p) {
    if (!stays_on(set, p) && set.field.factor_of(p, set.readings[reading].level) != 0.0) {
      return false;
    }
  }
  return true;
}

Sight everything(const ReadingSet& set) {
  const AxisMask all = AxisMask::Constant(set.size(), set.axis_count(), true);
  Sight sight{.counted = all, .visible = {}};
  for (std::size_t p = 0; p < set.field.parts().size(); ++p) {
    if (stays_on(set, p)) {
      sight.visible.assign(set.field.parts().size(), all);
    }
  }
  return sight;
}

// Returns for each design point the reading of an axis with all switchable lights off. Only
// readings that the axis uses are considered.
std::map<DesignPoint, double> readings_in_the_dark(const ReadingSet& set, Eigen::Index axis) {
  std::map<DesignPoint, double> dark;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (set.weights(i, axis) > 0.0 && is_as_dark_as_can_be(set, at)) {
      dark[*set.readings[at].point] = set.response(i, axis);
    }
  }
  if (dark.empty()) {
    throw SetupError(
        "one of the two lights on the one-sided axes is always on, and no reading was taken with "
        "the other light off (level 0), so the readings do not separate the two lights; take each "
        "point with the other light on and off, or darken the room");
  }
  return dark;
}

// Guesses which lights each axis sees, from the readings alone. An axis sees a switched light if it
// reads clearly more than with the light off. It sees a light that stays on if its reading at this
// design point, with the other lights off, is clearly larger than its smallest reading.
Sight sight_by_readings(const ReadingSet& set) {
  Sight sight = everything(set);
  const bool never_dark = !sight.visible.empty();
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    std::map<DesignPoint, double> dark;
    if (never_dark) {
      dark = readings_in_the_dark(set, k);
    }
    const auto used = set.weights.col(k).array() > 0.0;
    const double infinite = std::numeric_limits<double>::infinity();
    const double darkest = used.select(set.response.col(k).array(), infinite).minCoeff();
    double brightest_dark = darkest;
    for (const auto& [point, value] : dark) {
      brightest_dark = std::max(brightest_dark, value);
    }
    const auto dark_of = [&](Eigen::Index i) -> std::optional<double> {
      if (!never_dark) {
        return darkest;
      }
      const auto own = dark.find(*set.readings[static_cast<std::size_t>(i)].point);
      return own == dark.end() ? std::nullopt : std::optional(own->second);
    };
    double brightest = 0.0;
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      if (set.weights(i, k) > 0.0) {
        brightest = std::max(brightest, set.response(i, k) - dark_of(i).value_or(infinite));
      }
    }
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const std::optional<double> own = dark_of(i);
      sight.counted(i, k) = own && (is_as_dark_as_can_be(set, static_cast<std::size_t>(i)) ||
                                    set.response(i, k) - *own > 2.0 * grazing * brightest);
      for (std::size_t p = 0; p < sight.visible.size() && own; ++p) {
        sight.visible[p](i, k) =
            !stays_on(set, p) || *own > darkest + 2.0 * grazing * (brightest_dark - darkest);
      }
    }
  }
  return sight;
}

// Returns the directions of the lights that are on at a reading, in the sensor's frame. The
// directions of stated lamps are included; lights that always stay on are not.
std::vector<Eigen::Vector3d> lights_of(const ReadingSet& set,
                                       std::size_t reading,
                                       const TableField& field) {
  const FieldLevel& level = set.readings[reading].level;
  const Eigen::Matrix3d& R = set.rotation_sensor_from_table[reading];
  std::vector<Eigen::Vector3d> lights;
  for (std::size_t p = 0; p < field.parts().size(); ++p) {
    const double factor = field.factor_of(p, level);
    const Eigen::Vector3d vector = field.vector(field.is_sum() ? p : set.tilt_of(reading));
    if (stays_on(set, p) || factor == 0.0 || !(vector.norm() > 0.0)) {
      continue;
    }
    const Eigen::Vector3d met =
        set.field_then.empty() ? vector : Eigen::Vector3d(set.field_then[reading] * vector);
    lights.emplace_back(R * (factor * met).normalized());
    for (const Eigen::Vector3d& lamp : field.parts()[p].start.lamps) {
      // Each stated lamp is rotated by the rotation from the stated field vector to the fitted one.
      lights.emplace_back(R * (smallest_rotation(*field.parts()[p].in_table, vector) * lamp));
    }
  }
  return lights;
}

// Finds the lights that each axis sees according to the fitted model. An axis uses a reading if
// every switched light is in front of the axis, and if each light that stays on is clearly in front
// of it or clearly behind it. A light that stays on is ignored if its effect on the axis is too
// small to be separated from noise.
Sight sight_by_model(const ReadingSet& set, const Estimate& estimate) {
  Sight sight = everything(set);
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
      sight.counted(i, k) = std::all_of(
          lights.begin(), lights.end(),
          [&](const Eigen::Vector3d& light) { return S.dot(light) > grazing * S.norm(); });
      for (std::size_t p = 0; p < sight.visible.size(); ++p) {
        const Eigen::Vector3d light =
            stays_on(set, p)
                ? Eigen::Vector3d(set.rotation_sensor_from_table[at] * estimate.field.vector(p))
                : Eigen::Vector3d::Zero();
        constexpr double clear = 3.0;  // least effect of a light, in standard deviations
        if (S.norm() * light.norm() > clear * estimate.statistics.residual_sd(k)) {
          const double share = S.normalized().dot(light.normalized());
          sight.visible[p](i, k) = share > 0.0;
          sight.counted(i, k) = sight.counted(i, k) && std::abs(share) > grazing;
        }
      }
    }
  }
  return sight;
}

Estimate estimate_with(const Sight& sight,
                       Method method,
                       const ReadingSource& source,
                       const std::vector<FieldDescription>& parts) {
  ReadingSet set = source.set(parts, sight.counted);
  set.visible = sight.visible;
  try {
    Estimate estimate = estimate_by(method, set, source.by_field());
    estimate.sight.visible = sight.visible;
    return estimate;
  } catch (const RankDeficientError& error) {
    if (sight.visible.empty()) {
      throw;
    }
    throw SetupError(
        formatted("one of the two lights on the one-sided axes is always on, and the readings do "
                  "not separate the two lights for each axis ({}); darken the room, or take all 24 "
                  "points, each with the other light on and off",
                  error.what()));
  }
}

}  // namespace

Estimate estimate_one_sided(Method method,
                            const ReadingSource& source,
                            const std::vector<FieldDescription>& parts,
                            AxisMask& seen) {
  const ReadingSet all = source.set(parts, {});
  Sight sight = sight_by_readings(all);
  std::vector<Sight> earlier;
  constexpr int most_rounds = 20;
  for (int round = 1;; ++round) {
    Estimate estimate = estimate_with(sight, method, source, parts);
    seen = sight.counted;
    Sight next = sight_by_model(all, estimate);
    if (next == sight) {
      return estimate;
    }
    if (round == most_rounds || std::find(earlier.begin(), earlier.end(), next) != earlier.end()) {
      estimate.sight.unsettled = true;
      return estimate;
    }
    earlier.push_back(std::exchange(sight, std::move(next)));
  }
}

}  // namespace axiscal
