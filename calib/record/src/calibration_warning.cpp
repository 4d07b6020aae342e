// SPDX-License-Identifier: Apache-2.0
#include "calib/record/calibration_warning.hpp"

#include <utility>

#include "core/formatted.hpp"

namespace axiscal {

std::string name_of_runs(const std::vector<int>& runs) {
  std::string text = runs.size() == 1 ? "run " : "runs ";
  constexpr std::size_t most_names = 12;
  const std::size_t named = runs.size() > most_names ? most_names - 2 : runs.size();
  for (std::size_t i = 0; i < named; ++i) {
    text += i == 0 ? "" : i + 1 == runs.size() ? " and " : ", ";
    text += std::to_string(runs[i]);
  }
  return named < runs.size() ? formatted("{} and {} more", text, runs.size() - named) : text;
}

void add_warning(Calibration& calibration, CalibrationWarning warning) {
  calibration.findings.warnings.push_back(std::move(warning));
  if (calibration.findings.status == CalibrationStatus::ok) {
    calibration.findings.status = CalibrationStatus::warning;
  }
}

}  // namespace axiscal
