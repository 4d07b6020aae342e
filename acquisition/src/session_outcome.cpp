// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session_outcome.hpp"

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"

namespace axiscal {
namespace {

std::string verdict_of(const Calibration& calibration) {
  if (calibration.findings.verdict) {
    return calibration.findings.verdict->passed ? "Calibrated, and it meets its limits."
                                                : "It does not meet its limits.";
  }
  switch (calibration.findings.status) {
    case CalibrationStatus::ok:
      return "Calibrated. Nothing in the readings speaks against it.";
    case CalibrationStatus::warning:
      return "Calibrated, with something to look at.";
    case CalibrationStatus::refused:
      break;
  }
  return "Refused: do not use it.";
}

}  // namespace

SessionOutcome outcome_of(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  const std::string per_field = unit_per(instrument.unit, calibration.sensor.field.unit);
  SessionOutcome outcome{.slot = calibration.provenance.slot,
                         .status = std::string(status_name(calibration.findings.status)),
                         .verdict = verdict_of(calibration),
                         .head = {"axis", formatted("bias [{}]", instrument.unit)}};
  for (const char component : {'x', 'y', 'z'}) {
    outcome.head.push_back(formatted("S{} [{}]", component, per_field));
  }
  for (const std::string& axis : instrument.axes) {
    std::vector<std::string>& row = outcome.rows.emplace_back(std::vector{axis});
    for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
      const Quantity quantity = calibration.parameter(axis + of);
      row.push_back(formatted("{} \u00b1 {}", rounded_value(quantity.value, quantity.U),
                              rounded_uncertainty(quantity.U)));
    }
  }
  return outcome;
}

}  // namespace axiscal
