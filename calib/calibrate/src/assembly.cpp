// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/assembly.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/settings.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double disagreement_below = 0.001;
constexpr double rounding_rad = 1e-12;  // slopes that differ by less count as equal

// A weighted mean of slopes, and the variances of the mean. The components x and y are independent.
struct Mean {
  Eigen::Array2d value = Eigen::Array2d::Zero();
  Eigen::Array2d variance = Eigen::Array2d::Zero();
  double degrees_of_freedom = 0.0;
};

Eigen::Array2d slope_of(const Levelness& levelness) {
  const BlockLevelness now = levelness.current_levelness();
  return {now.x, now.y};
}

// Returns the variances of the slopes x and y. They have a lower limit, so that all slots have
// equal weights if the readings have no noise.
Eigen::Array2d variance_of(const Levelness& levelness) {
  const BlockLevelness now = levelness.current_levelness();
  return Eigen::Array2d(now.standard_error_x, now.standard_error_y)
      .square()
      .max(rounding_rad * rounding_rad);
}

Mean mean_without(const std::vector<SlotLevelness>& slots, std::size_t without) {
  Mean mean;
  Eigen::Array2d weights = Eigen::Array2d::Zero();
  double over_dof = 0.0;  // denominator in the formula of Welch and Satterthwaite
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
                "the instruments in slots {} are on one table, but they measure different slopes "
                "of the table (p = {}); check whether an instrument is loose, or the table bends "
                "under an instrument",
                joined(combined.slots), p)
          : formatted(
                "the instrument in slot {} measures a different slope of the common table than the "
                "other instruments (p = {}); check whether this instrument is loose, the table "
                "bends, or the design points of this slot are wrong",
                combined.suspect, p);
  add_warning(calibration, {.code = WarningCode::slot_levelness, .runs = {}, .message = message});
}

}  // namespace

std::vector<SlotObservations> split_by_slot(const Run& run) {
  const Observations& all = run.observations;
  const auto axes_of = [&](std::size_t slot) {
    return static_cast<Eigen::Index>(run.axes_of_slots.empty() ? run.axes.size()
                                                               : run.axes_of_slots[slot].size());
  };
  Eigen::Index columns = 0;
  for (std::size_t s = 0; s < run.slots.size(); ++s) {
    columns += axes_of(s);
  }
  if (run.slots.empty() || all.response.cols() != columns) {
    throw DomainError(
        "split_by_slot: the number of responses differs from the number of axes of all slots");
  }
  std::vector<SlotObservations> parts;
  Eigen::Index first = 0;
  for (std::size_t s = 0; s < run.slots.size(); ++s) {
    const Eigen::Index m = axes_of(s);
    SlotObservations& part =
        parts.emplace_back(SlotObservations{.slot = run.slots[s], .observations = all});
    part.observations.response = all.response.middleCols(first, m);
    if (all.response_sd) {
      part.observations.response_sd = all.response_sd->middleCols(first, m);
    }
    if (all.saturated) {
      part.observations.saturated = all.saturated->middleCols(first, m);
    }
    for (Reading& reading : part.observations.readings) {
      if (reading.temperature) {
        reading.temperature = reading.temperature->of_some(first, m);
      }
    }
    first += m;
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
      formatted("the positioner does not have a slot '{}'; its slots are {}", slot, joined(names)));
}

std::vector<Mount> mounts_of_assembly(const std::string& assembly,
                                      const std::vector<std::string>& slots) {
  struct Known {
    std::string_view name;
    std::size_t slots;  // required number of slots; 0 if any number is allowed
  };
  constexpr std::array<Known, 5> known = {
      {{"parallel", 0}, {"single", 1}, {"triple", 3}, {"h", 2}, {"h:y", 2}}};
  const auto* found = std::find_if(known.begin(), known.end(),
                                   [&](const Known& one) { return one.name == assembly; });
  if (found == known.end()) {
    throw DomainError(
        formatted("the assembly must be parallel, single, triple, h or h:y, not "
                  "'{}'",
                  assembly));
  }
  if (slots.empty() || (found->slots != 0 && slots.size() != found->slots)) {
    throw DomainError(formatted(
        "assembly '{}' requires {}, but the columns (SLOT.axis) name {} "
        "slots",
        assembly, found->slots == 0 ? "slots" : formatted("{} slots", found->slots), slots.size()));
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
  // For two slots, the tests of both slots are identical, so they count as one test.
  const double tests = slots.size() == 2 ? 1.0 : static_cast<double>(slots.size());
  combined.p_value = std::min(1.0, tests * smallest);
  combined.consistent = !(combined.p_value < disagreement_below);
  if (combined.consistent || slots.size() == 2) {
    combined.suspect.clear();
  }
  return combined;
}

namespace {

// Returns the rotation from the cube's frame to the frame of the instrument's axes. It is the
// rotation matrix that is closest to S after each row of S is scaled to length 1.
Eigen::Matrix3d axes_from_cube(const Calibration& calibration, const LinearResponse& response) {
  const Eigen::Matrix3d mount =
      calibration.sensor.rotation_sensor_from_assembly.value_or(Eigen::Matrix3d::Identity());
  return nearest_rotation(Eigen::Matrix3d(response.sensitivity.rowwise().normalized()) * mount);
}

// Returns the derivative of axes_from_cube() with respect to the p coefficients of each axis. Each
// column is a small rotation about the axes of the instrument's frame: 3 x 3 p [rad per unit of the
// coefficient].
Eigen::MatrixXd turn_with_parameters(const Calibration& calibration) {
  const LinearResponse& response = calibration.sensor.response;
  const Eigen::Matrix3d R = axes_from_cube(calibration, response);
  const Eigen::Index p = calibration.fit.statistics->covariance.rows() / 3;
  Eigen::MatrixXd turns = Eigen::MatrixXd::Zero(3, 3 * p);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double step = 1e-5 * response.sensitivity.row(k).norm();
    for (Eigen::Index j = 0; j < 3; ++j) {
      LinearResponse moved = response;
      moved.sensitivity(k, j) += step;
      const Eigen::Matrix3d turned = axes_from_cube(calibration, moved) * R.transpose();
      const Eigen::Matrix3d twice = turned - turned.transpose();  // twice the small rotation
      turns.col(p * k + 1 + j) =
          Eigen::Vector3d(twice(2, 1), twice(0, 2), twice(1, 0)) / (2.0 * step);
    }
  }
  return turns;
}

bool has_alignment(const Calibration& calibration) {
  return calibration.sensor.response.bias.size() == 3 &&
         !method_kind(calibration.fit.method).by_magnitude &&
         method_kind(calibration.fit.method).fits_sensitivity && calibration.fit.statistics &&
         calibration.fit.statistics->covariance.rows() >= 12 &&
         calibration.sensor.response.sensitivity.determinant() > 0.0;
}

// Returns true if the record contains the table's slope, measured in a vertical field.
bool shows_slope(const Calibration& calibration) {
  return calibration.fit.levelness && field_kind(calibration.sensor.field.kind).vertical;
}

// Returns the experiment of a single slot.
Experiment experiment_of_slot(const Experiment& experiment, const std::string& slot) {
  Experiment own = experiment;
  own.slots.clear();
  own.slot = slot;
  own.rotation_sensor_from_positioner = mount_rotation(experiment.positioner, slot);
  if (!experiment.slots.empty()) {
    const auto found = std::find_if(experiment.slots.begin(), experiment.slots.end(),
                                    [&](const SlotSetup& one) { return one.slot == slot; });
    if (found == experiment.slots.end()) {
      throw SetupError(formatted("slot {}: the instrument in this slot is missing", slot),
                       {settings::instrument});
    }
    own.instrument = found->instrument;
    own.field = found->field;
  }
  return own;
}

Calibration calibrate_slot(const Experiment& own,
                           const SlotObservations& slot,
                           bool is_one_of_many) {
  try {
    Calibration calibration = calibrate(own, slot.observations);
    const Eigen::Matrix3d& mount = own.rotation_sensor_from_positioner;
    if (is_one_of_many && !mount.isIdentity(0.0)) {
      calibration.sensor.rotation_sensor_from_assembly = mount;
    }
    return calibration;
  } catch (const SetupError& error) {
    throw SetupError(formatted("slot {}: {}", slot.slot, error.what()), error.settings());
  } catch (const RankDeficientError& error) {
    throw RankDeficientError(formatted("slot {}: {}", slot.slot, error.what()),
                             error.undetermined(), error.settings());
  } catch (const RefusedError& error) {
    throw RefusedError(formatted("slot {}: {}", slot.slot, error.what()), error.settings());
  }
}

// Combines the slopes of the table that the slots in a vertical field measured, and adds the result
// to the records of these slots.
std::optional<CombinedLevelness> combined_levelness(std::vector<Calibration>& calibrations) {
  std::vector<SlotLevelness> levelness;
  for (const Calibration& calibration : calibrations) {
    if (shows_slope(calibration)) {
      levelness.push_back(
          {.slot = calibration.provenance.slot, .levelness = *calibration.fit.levelness});
    }
  }
  if (levelness.size() < 2) {
    return std::nullopt;
  }
  CombinedLevelness combined = combine_levelness(levelness);
  for (Calibration& calibration : calibrations) {
    if (shows_slope(calibration)) {
      calibration.fit.levelness->combined = combined;
      warn_of_disagreement(calibration, combined);
    }
  }
  return combined;
}

// Sets the table's slope in the experiment of a slot with a non-vertical field to the slope that
// the other slots measured.
void take_slope(const std::vector<Calibration>& calibrations,
                const std::optional<CombinedLevelness>& combined,
                Experiment& experiment) {
  if (!experiment.table.slope.isZero(0.0) || experiment.stated.slope_u > 0.0 ||
      experiment.field.in_table) {
    return;  // the field's direction is stated
  }
  if (combined) {
    if (combined->consistent) {
      experiment.table.slope = {combined->x, combined->y};
      experiment.stated.slope_u = std::max(combined->standard_error_x, combined->standard_error_y);
    }
    return;
  }
  for (const Calibration& calibration : calibrations) {
    if (shows_slope(calibration) && calibration.fit.levelness->consistent) {
      const BlockLevelness now = calibration.fit.levelness->current_levelness();
      experiment.table.slope = {now.x, now.y};
      experiment.stated.slope_u = std::max(now.standard_error_x, now.standard_error_y);
    }
  }
  if (std::isnan(experiment.stated.slope_u)) {
    experiment.stated.slope_u = 0.0;
  }
}

}  // namespace

SlotAlignment alignment_of(const Calibration& from, const Calibration& to) {
  if (!has_alignment(from) || !has_alignment(to)) {
    throw DomainError(
        "alignment_of: both instruments need three axes and a calibration by design points");
  }
  SlotAlignment alignment{.slot = to.provenance.slot};
  const Eigen::Matrix3d R = axes_from_cube(to, to.sensor.response) *
                            axes_from_cube(from, from.sensor.response).transpose();
  alignment.rotation_other_from_sensor = R;
  const Eigen::MatrixXd of_to = turn_with_parameters(to);
  const Eigen::MatrixXd of_from = R * turn_with_parameters(from);
  for (Eigen::Index j = 0; j < 3; ++j) {
    VarianceShares shares = scatter_shares(to, of_to.row(j));
    shares += scatter_shares(from, of_from.row(j));
    const CombinedUncertainty uncertainty = combine(shares);
    alignment.u_rad(j) = uncertainty.u;
    alignment.expanded_rad(j) = uncertainty.expanded;
  }
  return alignment;
}

Eigen::Vector3d rotation_without_quarter_turns(const SlotAlignment& alignment) {
  Eigen::Matrix3d quarters = alignment.rotation_other_from_sensor.array().round();
  if (!quarters.isUnitary()) {
    quarters.setIdentity();
  }
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(alignment.rotation_other_from_sensor * quarters.transpose()));
  return turn.angle() * turn.axis();
}

std::vector<Calibration> calibrate_assembly(const Experiment& experiment,
                                            const std::vector<SlotObservations>& slots) {
  for (const SlotObservations& slot : slots) {
    const std::vector<Reading>& readings = slot.observations.readings;
    if (slots.size() > 1 && !readings.empty() && readings.front().field_in_sensor) {
      throw SetupError(
          "columns fx, fy, fz give the field in the frame of one instrument, but the file contains "
          "readings of several slots; make one file for each slot");
    }
  }
  // Slots in a vertical field are calibrated first, because they measure the table's slope.
  std::vector<Calibration> calibrations(slots.size());
  std::vector<Calibration> showing;
  std::optional<CombinedLevelness> combined;
  for (const bool vertical : {true, false}) {
    for (std::size_t s = 0; s < slots.size(); ++s) {
      Experiment own = experiment_of_slot(experiment, slots[s].slot);
      if (field_kind(own.field.kind()).vertical != vertical) {
        continue;
      }
      if (!vertical) {
        take_slope(showing, combined, own);
      }
      Calibration calibration = calibrate_slot(own, slots[s], slots.size() > 1);
      if (vertical) {
        showing.push_back(std::move(calibration));
      } else {
        calibrations[s] = std::move(calibration);
      }
    }
    if (vertical) {
      combined = combined_levelness(showing);
    }
  }
  for (Calibration& calibration : showing) {
    const auto place = std::find_if(slots.begin(), slots.end(), [&](const SlotObservations& slot) {
      return slot.slot == calibration.provenance.slot;
    });
    calibrations[static_cast<std::size_t>(place - slots.begin())] = std::move(calibration);
  }
  for (Calibration& calibration : calibrations) {
    for (const Calibration& other : calibrations) {
      if (&other != &calibration && has_alignment(calibration) && has_alignment(other)) {
        calibration.fit.slot_alignments.push_back(alignment_of(calibration, other));
      }
    }
  }
  return calibrations;
}

}  // namespace axiscal
