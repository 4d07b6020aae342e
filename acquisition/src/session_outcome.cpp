// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/session_outcome.hpp"

#include "axiscal/calib/summary.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "core/formatted.hpp"

namespace axiscal {
SessionOutcome outcome_of(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  const std::string per_field = unit_per(instrument.unit, calibration.sensor.field.unit);
  SessionOutcome outcome{.slot = calibration.provenance.slot,
                         .status = std::string(status_name(calibration.findings.status)),
                         .verdict = verdict_sentence(calibration),
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
