// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration.hpp"

#include <algorithm>

#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/error.hpp"
#include "calib/record/parameter_names.hpp"

namespace axiscal {
namespace {

// Returns the covariance of bias and sensitivity, 4 m x 4 m; empty if a parameter is missing.
Eigen::MatrixXd covariance_of(const Calibration& calibration) {
  if (!calibration.fit.statistics) {
    return {};
  }
  std::vector<Eigen::Index> kept;
  for (const std::string& axis : calibration.sensor.instrument.axes) {
    for (const std::string& name : parameter_names({axis})) {
      const std::optional<Eigen::Index> at = calibration.fit.statistics->position_of(name);
      if (!at) {
        return {};
      }
      kept.push_back(*at);
    }
  }
  return calibration.fit.statistics->covariance(kept, kept);
}

}  // namespace

void require_unrefused(const Calibration& calibration, Force force) {
  if (force == Force::no && calibration.findings.status == CalibrationStatus::refused) {
    const std::vector<CalibrationWarning>& warnings = calibration.findings.warnings;
    throw RefusedError("the calibration is refused" +
                       (warnings.empty() ? std::string() : ": " + warnings.front().message));
  }
}

bool gives_field(const Calibration& calibration) {
  // A record of method `bias` has sensitivity parameters only if they come from another record.
  return method_kind(calibration.fit.method).fits_sensitivity ||
         (calibration.fit.statistics &&
          calibration.fit.statistics->position_of(calibration.sensor.instrument.axes.front() +
                                                  ".sensitivity.x"));
}

bool is_made_from(const Calibration& calibration, const std::vector<InputFileDigest>& inputs) {
  const std::vector<InputFileDigest>& own = calibration.provenance.inputs;
  return std::any_of(own.begin(), own.end(), [&](const InputFileDigest& one) {
    return !one.sha256.empty() &&
           std::any_of(inputs.begin(), inputs.end(),
                       [&](const InputFileDigest& other) { return other.sha256 == one.sha256; });
  });
}

std::vector<KindQuantity> quantities_of(const Calibration& calibration) {
  return quantities_of(calibration.sensor, covariance_of(calibration));
}

}  // namespace axiscal
