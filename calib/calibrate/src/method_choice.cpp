// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/method_choice.hpp"

#include <algorithm>
#include <set>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

bool has_stated_fields(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.field_in_sensor.has_value(); });
}

bool has_labels(const Observations& observations) {
  return !observations.readings.empty() &&
         std::all_of(observations.readings.begin(), observations.readings.end(),
                     [](const Reading& reading) { return reading.point.has_value(); });
}

namespace {

// Returns true if the cube lay on each of its six faces at least once.
bool shows_six_faces(const Observations& observations) {
  std::set<int> faces;
  for (const Reading& reading : observations.readings) {
    if (reading.point) {
      faces.insert(static_cast<int>(reading.point->rest()));
    } else if (reading.field_in_sensor) {
      Eigen::Index component = 0;
      reading.field_in_sensor->cwiseAbs().maxCoeff(&component);
      const bool is_negative = (*reading.field_in_sensor)(component) < 0.0;
      faces.insert(static_cast<int>(2 * component) + (is_negative ? 1 : 0));
    }
  }
  return faces.size() == all_faces.size();
}

}  // namespace

Method choose_method(const Experiment& experiment, const Observations& observations) {
  if (experiment.fit.method) {
    return *experiment.fit.method;
  }
  if (!observations.has_fence && shows_six_faces(observations)) {
    return Method::faces;
  }
  if (has_stated_fields(observations)) {
    return Method::known;
  }
  if (!has_labels(observations)) {
    return Method::magnitude;
  }
  if (!observations.has_fence) {
    return Method::known;
  }
  return Method::joint;
}

void note_choice_of_method(const Observations& used, Method method, Calibration& calibration) {
  if (method_kind(method).directions_known && !method_kind(method).by_length && has_labels(used) &&
      !used.has_fence) {
    calibration.findings.notes.push_back(
        {NoteCode::method,
         "the readings lack fence faces, so the table is taken as level. A slope of the table "
         "changes the biases and cross-axis terms; the uncertainties include this error only if "
         "the uncertainty of the slope is given"});
  }
}

}  // namespace axiscal
