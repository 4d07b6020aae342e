// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/calibration.hpp"

namespace axiscal {
namespace {

// Of bias and sensitivity alone, 4 for each axis.
Eigen::MatrixXd covariance_of(const Calibration& calibration) {
  const Eigen::Index m = calibration.response.bias.size();
  if (!calibration.statistics || m == 0) {
    return {};
  }
  const Eigen::MatrixXd& all = calibration.statistics->covariance;
  const Eigen::Index p = all.rows() / m;
  if (all.rows() != p * m || p < 4) {
    return {};
  }
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < m; ++k) {
    for (Eigen::Index j = 0; j < 4; ++j) {
      kept.push_back(p * k + j);
    }
  }
  return all(kept, kept);
}

}  // namespace

std::vector<Quantity> quantities_of(const Calibration& calibration) {
  const InstrumentKind& kind = find_instrument_kind(calibration.instrument.kind);
  if (kind.describe == nullptr) {
    return {};
  }
  const FieldDescription& field = calibration.field;
  return kind.describe({.instrument = calibration.instrument,
                        .response = calibration.response,
                        .covariance = covariance_of(calibration),
                        .field_kind = field.kind,
                        .field_unit = field.unit,
                        .magnitude = field.magnitude,
                        .in_table = field.in_table,
                        .in_table_covariance = field.in_table_covariance});
}

}  // namespace axiscal
