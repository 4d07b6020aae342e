// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/assembly_session.hpp"

#include <algorithm>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/calibrate.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/instruments/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {

Experiment assembled(Experiment experiment, const std::vector<std::string>& slots) {
  Instrument& instrument = experiment.instrument;
  if (!instrument.differences.empty()) {
    throw SetupError("a session of several instruments does not support differences of columns",
                     {settings::axes});
  }
  std::vector<std::string> axes;
  for (const std::string& slot : slots) {
    for (const std::string& axis : instrument.axes) {
      axes.push_back(formatted("{}.{}", slot, axis));
    }
  }
  instrument.axes = std::move(axes);
  experiment.slot.clear();
  return experiment;
}

std::vector<SlotColumns> slots_of(const Instrument& instrument) {
  std::vector<SlotColumns> slots;
  for (const std::string& axis : instrument.axes) {
    const std::size_t point = axis.find('.');
    if (point == std::string::npos) {
      return {};
    }
    const std::string slot = axis.substr(0, point);
    const auto found = std::find_if(slots.begin(), slots.end(),
                                    [&](const SlotColumns& one) { return one.slot == slot; });
    SlotColumns& columns =
        found != slots.end() ? *found : slots.emplace_back(SlotColumns{.slot = slot, .axes = {}});
    columns.axes.push_back(axis.substr(point + 1));
  }
  return slots.size() > 1 ? slots : std::vector<SlotColumns>();
}

SensitivityMatrix nominal_axes(const Experiment& experiment) {
  const Instrument& instrument = experiment.instrument;
  SensitivityMatrix rows = SensitivityMatrix::Zero(instrument.axis_count(), 3);
  const std::vector<SlotColumns> slots = slots_of(instrument);
  Eigen::Index k = 0;
  const auto put = [&](const Eigen::Matrix3d& mount) {
    if (const std::optional<int> axis = nominal_axis(instrument, k)) {
      rows.row(k) = mount.row(*axis);
    }
    ++k;
  };
  for (const SlotColumns& slot : slots) {
    for (std::size_t i = 0; i < slot.axes.size(); ++i) {
      put(mount_rotation(experiment.positioner, slot.slot));
    }
  }
  while (k < instrument.axis_count()) {
    put(Eigen::Matrix3d::Identity());
  }
  return rows;
}

std::vector<Calibration> calibrate_session(const Experiment& experiment,
                                           const Observations& observations) {
  const std::vector<SlotColumns> slots = slots_of(experiment.instrument);
  if (slots.empty()) {
    return {calibrate(experiment, observations)};
  }
  Run run;
  run.observations = observations;
  Experiment one = experiment;
  one.instrument.axes = slots.front().axes;
  run.axes = one.instrument.axes;
  for (const SlotColumns& slot : slots) {
    run.slots.push_back(slot.slot);
  }
  return calibrate_assembly(one, split_by_slot(run));
}

}  // namespace axiscal
