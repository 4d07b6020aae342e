// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/assembly.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_warning.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {
namespace {

constexpr double disagreement_below = 0.001;
constexpr double rounding_rad = 1e-12;  // slopes that differ by less are the same

// A mean of slopes with its variances (the two components are independent).
struct Mean {
  Eigen::Array2d value = Eigen::Array2d::Zero();
  Eigen::Array2d variance = Eigen::Array2d::Zero();
  double degrees_of_freedom = 0.0;
};

Eigen::Array2d slope_of(const Levelness& levelness) {
  const BlockLevelness now = levelness.as_it_stands();
  return {now.x, now.y};
}

// Without noise all weigh alike.
Eigen::Array2d variance_of(const Levelness& levelness) {
  const BlockLevelness now = levelness.as_it_stands();
  return Eigen::Array2d(now.standard_error_x, now.standard_error_y)
      .square()
      .max(rounding_rad * rounding_rad);
}

Mean mean_without(const std::vector<SlotLevelness>& slots, std::size_t without) {
  Mean mean;
  Eigen::Array2d weights = Eigen::Array2d::Zero();
  double over_dof = 0.0;  // Welch and Satterthwaite
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (i == without) {
      continue;
    }
    const Levelness& own = slots[i].levelness;
    const Eigen::Array2d variance = variance_of(own);
    weights += variance.inverse();
    mean.value += slope_of(own) / variance;
    over_dof += variance.inverse().square().sum() / own.degrees_of_freedom;
  }
  mean.value /= weights;
  mean.variance = weights.inverse();
  mean.degrees_of_freedom = weights.square().sum() / over_dof;
  return mean;
}

void warn_of_disagreement(Calibration& calibration, const CombinedLevelness& combined) {
  if (combined.consistent ||
      (!combined.suspect.empty() && combined.suspect != calibration.provenance.slot)) {
    return;
  }
  const std::string p = number_text(std::round(combined.p_value * 1e6) * 1e-6);
  const std::string message =
      combined.suspect.empty()
          ? formatted(
                "slots {} stand on one table but disagree about its slope (p = {}); an instrument "
                "is loose, or the table gives way under one",
                joined(combined.slots), p)
          : formatted(
                "slot {} disagrees with the other slots about the slope of the table that all "
                "stand on (p = {}); is its instrument loose, does the table give way, are its "
                "readings those of other points?",
                combined.suspect, p);
  add_warning(calibration, {.code = WarningCode::slot_levelness, .runs = {}, .message = message});
}

}  // namespace

std::vector<SlotObservations> split_by_slot(const Observations& all,
                                            const std::vector<std::string>& slots) {
  const auto count = static_cast<Eigen::Index>(slots.size());
  if (count == 0 || all.response.cols() % count != 0) {
    throw DomainError("split_by_slot: each slot needs as many axes");
  }
  const Eigen::Index m = all.response.cols() / count;
  std::vector<SlotObservations> parts;
  for (Eigen::Index s = 0; s < count; ++s) {
    SlotObservations& part = parts.emplace_back(
        SlotObservations{.slot = slots[static_cast<std::size_t>(s)], .observations = all});
    part.observations.response = all.response.middleCols(s * m, m);
    if (all.response_sd) {
      part.observations.response_sd = all.response_sd->middleCols(s * m, m);
    }
  }
  return parts;
}

bool is_of_reference(const Positioner& positioner, const std::string& slot) {
  const std::vector<MeasuredFrom>& from = positioner.description().from;
  return std::any_of(from.begin(), from.end(),
                     [&](const MeasuredFrom& reference) { return reference.slot == slot; });
}

Eigen::Matrix3d mount_rotation(const Positioner& positioner, const std::string& slot) {
  const std::vector<Mount>& mounts = positioner.mounts();
  if (mounts.empty() || (slot.empty() && mounts.size() > 1)) {
    return Eigen::Matrix3d::Identity();
  }
  if (slot.empty()) {
    return is_of_reference(positioner, mounts.front().slot)
               ? Eigen::Matrix3d::Identity()
               : mounts.front().rotation_sensor_from_positioner;
  }
  if (const std::optional<Mount> mount = positioner.mount(slot)) {
    return mount->rotation_sensor_from_positioner;
  }
  std::vector<std::string> names;
  names.reserve(mounts.size());
  for (const Mount& mount : mounts) {
    names.push_back(mount.slot);
  }
  throw SetupError(
      formatted("the positioner has no mount for slot '{}'; its slots: {}", slot, joined(names)));
}

std::vector<Mount> mounts_of_assembly(const std::string& assembly,
                                      const std::vector<std::string>& slots) {
  struct Known {
    std::string_view name;
    std::size_t slots;  // 0: any number
  };
  constexpr std::array<Known, 5> known = {
      {{"parallel", 0}, {"single", 1}, {"triple", 3}, {"h", 2}, {"h:y", 2}}};
  const auto* found = std::find_if(known.begin(), known.end(),
                                   [&](const Known& one) { return one.name == assembly; });
  if (found == known.end()) {
    throw DomainError(formatted("must be parallel, single, triple, h or h:y, not '{}'", assembly));
  }
  if (slots.empty() || (found->slots != 0 && slots.size() != found->slots)) {
    throw DomainError(formatted("'{}' has {}, but the columns SLOT.axis have {}", assembly,
                                found->slots == 0 ? "slots" : formatted("{} slots", found->slots),
                                slots.size()));
  }
  if (assembly.starts_with("h")) {
    return h_shaped_mounts(slots[0], slots[1], assembly == "h" ? WebAxis::x : WebAxis::y);
  }
  return parallel_mounts(slots);
}

CombinedLevelness combine_levelness(const std::vector<SlotLevelness>& slots) {
  if (slots.size() < 2) {
    throw DomainError("combine_levelness: at least two slots are needed");
  }
  const Mean all = mean_without(slots, slots.size());
  CombinedLevelness combined{.slots = {},
                             .x = all.value(0),
                             .y = all.value(1),
                             .standard_error_x = std::sqrt(all.variance(0)),
                             .standard_error_y = std::sqrt(all.variance(1)),
                             .suspect = {}};
  double smallest = 2.0;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const Levelness& own = slots[i].levelness;
    combined.slots.push_back(slots[i].slot);
    const Mean others = mean_without(slots, i);
    const Eigen::Array2d difference = slope_of(own) - others.value;
    const Eigen::Array2d variance = others.variance + variance_of(own);
    const double f = 0.5 * (difference.square() / variance).sum();
    const double dof =
        variance.square().sum() / (variance_of(own).square().sum() / own.degrees_of_freedom +
                                   others.variance.square().sum() / others.degrees_of_freedom);
    const double p = f_upper_p(f, 2.0, dof);
    if (std::isnan(p)) {
      combined.p_value = not_a_number;
      return combined;
    }
    if (p < smallest) {
      smallest = p;
      combined.suspect = slots[i].slot;
    }
  }
  // Of two slots both tests are the same one.
  const double tests = slots.size() == 2 ? 1.0 : static_cast<double>(slots.size());
  combined.p_value = std::min(1.0, tests * smallest);
  combined.consistent = !(combined.p_value < disagreement_below);
  if (combined.consistent || slots.size() == 2) {
    combined.suspect.clear();
  }
  return combined;
}

std::vector<Calibration> calibrate_assembly(const Experiment& experiment,
                                            const std::vector<SlotObservations>& slots) {
  std::vector<Calibration> calibrations;
  std::vector<SlotLevelness> levelness;
  for (const SlotObservations& slot : slots) {
    const std::vector<Reading>& readings = slot.observations.readings;
    if (slots.size() > 1 && !readings.empty() && readings.front().field_in_sensor) {
      throw SetupError(
          "columns fx, fy, fz are the field in one instrument's frame, but the readings are of "
          "several slots; give each slot a file of its own");
    }
  }
  for (const SlotObservations& slot : slots) {
    Experiment own = experiment;
    own.slot = slot.slot;
    own.rotation_sensor_from_positioner = mount_rotation(experiment.positioner, slot.slot);
    try {
      calibrations.push_back(calibrate(own, slot.observations));
    } catch (const SetupError& error) {
      throw SetupError(formatted("slot {}: {}", slot.slot, error.what()), error.settings());
    } catch (const RankDeficientError& error) {
      throw RankDeficientError(formatted("slot {}: {}", slot.slot, error.what()),
                               error.undetermined(), error.settings());
    } catch (const RefusedError& error) {
      throw RefusedError(formatted("slot {}: {}", slot.slot, error.what()), error.settings());
    }
    if (const std::optional<Levelness>& measured = calibrations.back().fit.levelness) {
      levelness.push_back({.slot = slot.slot, .levelness = *measured});
    }
  }
  if (levelness.size() == slots.size() && slots.size() > 1) {
    const CombinedLevelness combined = combine_levelness(levelness);
    for (Calibration& calibration : calibrations) {
      calibration.fit.levelness->combined = combined;
      warn_of_disagreement(calibration, combined);
    }
  }
  return calibrations;
}

}  // namespace axiscal
