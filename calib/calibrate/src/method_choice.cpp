// SPDX-License-Identifier: Apache-2.0
#include "method_choice.hpp"

#include <algorithm>
#include <set>
#include <tuple>

#include "axiscal/calib/calibration_warning.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/field/field_kind.hpp"

namespace axiscal {
namespace {

// The runs whose opposite was not taken.
// @param soak  number of the soak level of each reading; empty: all of one.
std::vector<int> runs_without_opposite(const Observations& observations,
                                       const std::vector<int>& soak) {
  using Key = std::tuple<int, FieldLevel, int, DesignPoint>;
  std::set<Key> there;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    there.emplace(reading.block, reading.level, soak.empty() ? 0 : soak[i], *reading.point);
  }
  std::vector<int> runs;
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    if (!there.contains({reading.block, reading.level, soak.empty() ? 0 : soak[i],
                         reading.point->turned_round()})) {
      runs.push_back(reading.run);
    }
  }
  return runs;
}

// Why readings of a field along the normal cannot be paired; empty where they can.
std::string why_not_paired(const Experiment& experiment, const Observations& observations) {
  std::vector<int> soak;
  if (experiment.temperature.order > 0 || experiment.temperature.automatic) {
    std::vector<double> temperatures;
    for (const Reading& reading : observations.readings) {
      temperatures.push_back(reading.temperature ? reading.temperature->mean() : 0.0);
    }
    soak = soak_levels(temperatures);
    if (soak.empty()) {
      return "opposite readings were not taken at one temperature";
    }
  }
  const std::vector<int> runs = runs_without_opposite(observations, soak);
  return runs.empty() ? ""
                      : formatted(
                            "{}{} no opposite reading (the same rest face, the fence face turned "
                            "by 180 degrees)",
                            name_of_runs(runs), runs.size() == 1 ? " has" : " have");
}

bool lies_along_normal(const Experiment& experiment) {
  const FieldSetup& field = experiment.field;
  if (!field.others.empty() || field_moves(experiment) || experiment.instrument.one_sided) {
    return false;
  }
  if (field.in_table) {
    return field.in_table->x() == 0.0 && field.in_table->y() == 0.0;
  }
  return field_kind(field.kind()).along_normal;
}

}  // namespace

bool brings_field(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.field_in_sensor.has_value(); });
}

bool has_labels(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.point.has_value(); });
}

Method choose_method(const Experiment& experiment, const Observations& observations) {
  if (experiment.method) {
    return *experiment.method;
  }
  if (brings_field(observations)) {
    return Method::known;
  }
  if (!has_labels(observations)) {
    return Method::magnitude;
  }
  if (!observations.has_fence) {
    return Method::known;
  }
  if (!lies_along_normal(experiment)) {
    return Method::joint;
  }
  return why_not_paired(experiment, observations).empty() ? Method::paired : Method::joint;
}

void note_choice_of_method(const Experiment& experiment,
                           const Observations& used,
                           Method method,
                           Calibration& calibration) {
  if (method_kind(method).directions_known && has_labels(used) && !used.has_fence) {
    calibration.findings.notes.push_back(
        {NoteCode::method,
         "six faces without fence faces: the table is taken as level; its slope is in the biases "
         "and the cross-axis terms, and their uncertainty holds it only where that of the slope "
         "is stated"});
  }
  if (!experiment.method && method == Method::joint && has_labels(used) &&
      lies_along_normal(experiment)) {
    calibration.findings.notes.push_back(
        {NoteCode::method,
         formatted(
             "method joint instead of paired: {}; take what is missing, or state method joint",
             why_not_paired(experiment, used))});
  }
}

}  // namespace axiscal
