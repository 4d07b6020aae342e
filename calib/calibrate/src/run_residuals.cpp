// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/run_residuals.hpp"

#include <optional>

#include "axiscal/calib/lit_response.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "calib/regression/factor.hpp"

namespace axiscal {
namespace {

// Returns the reading that the fit predicts.
Eigen::VectorXd fitted_response(const Calibration& calibration,
                                const ReadingSource& source,
                                const Reading& reading,
                                const TableField& fitted,
                                const Eigen::Vector3d& field) {
  const bool by_lights = calibration.sensor.instrument.one_sided && fitted.is_sum() &&
                         fitted.has_vectors() && reading.point;
  Eigen::VectorXd response = by_lights
                                 ? light_response_at(calibration.sensor, fitted, reading.level,
                                                     source.rotation(reading), reading.temperature)
                                 : response_at(calibration.sensor, field, reading.temperature);
  for (const AlsoResponse& also : calibration.sensor.also) {
    response += also.sensitivity * (source.rotation(reading) * also.in_table);
  }
  return response;
}

}  // namespace

std::vector<ReadingResidual> residuals_of(const Observations& observations,
                                          const ReadingSource& source,
                                          const TableField& fitted,
                                          const Positioner& positioner,
                                          const Calibration& calibration,
                                          const AxisMask& used) {
  const LinearResponse& response = calibration.sensor.response;
  const auto [inverse, rank] = pseudo_inverse_with_rank(response.sensitivity);
  const bool has_magnitude = rank == 3;
  const bool by_magnitude = (!fitted.has_vectors() && !source.by_field()) ||
                            (method_kind(calibration.fit.method).by_length && has_magnitude);
  // True if the prediction needs only bias, S and the field, which is the usual case.
  const bool plain = !calibration.sensor.temperature && calibration.sensor.also.empty() &&
                     !calibration.sensor.instrument.one_sided;
  std::vector<ReadingResidual> residuals;
  residuals.reserve(observations.readings.size());
  Eigen::VectorXd v;
  Eigen::VectorXd left;
  // If the instrument has two axes and was rotated in a plane, this matrix converts readings to the
  // field in that plane. For other instruments it is empty.
  const Eigen::MatrixXd in_plane =
      method_kind(calibration.fit.method).by_magnitude && !has_magnitude ? inverse
                                                                         : Eigen::MatrixXd();
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const Reading& reading = observations.readings[i];
    const auto row = static_cast<Eigen::Index>(i);
    ReadingResidual residual{.run = reading.run, .point = reading.point};
    residual.used = used.row(row).any();
    residual.magnitude = not_a_number;
    if (!residual.used && reading.point && !positioner.seat(*reading.point).defect.empty()) {
      // The cube cannot lie at this design point, so the reading was left out and has no predicted
      // field.
      residual.response = Eigen::VectorXd::Constant(response.bias.size(), not_a_number);
      residuals.push_back(std::move(residual));
      continue;
    }
    v = observations.response.row(row);
    const bool complete = source.in_range().row(row).all() && calibration.sensor.also.empty();
    if (plain) {
      left = v - response.bias;
    } else {
      left = reading_at_reference(calibration.sensor, v, reading.temperature) - response.bias;
    }
    const Eigen::Vector3d measured = has_magnitude         ? Eigen::Vector3d(inverse * left)
                                     : in_plane.size() > 0 ? Eigen::Vector3d(in_plane * left)
                                                           : Eigen::Vector3d::Zero();
    const Eigen::Vector3d field =
        by_magnitude ? Eigen::Vector3d(calibration.sensor.field.magnitude * measured.normalized())
                     : source.field_in_sensor(reading, fitted);
    if (plain) {
      left.noalias() = response.sensitivity.lazyProduct(field);
      left += response.bias;
    } else {
      left = fitted_response(calibration, source, reading, fitted, field);
    }
    residual.response = v - left;
    for (Eigen::Index k = 0; k < left.size(); ++k) {
      // The residual of an axis is NaN if the reading is outside the range of the axis, or if the
      // fits of other axes used the reading but the fit of this axis did not. A reading that no
      // axis used keeps its residuals.
      if (!source.in_range()(row, k) || (residual.used && !used(row, k))) {
        residual.response(k) = not_a_number;
      }
    }
    if (has_magnitude && complete && !calibration.sensor.instrument.one_sided) {
      residual.magnitude = measured.norm() - field.norm();
    }
    if (observations.has_level) {
      residual.level = reading.level;
    }
    if (observations.has_block) {
      residual.block = reading.block;
    }
    residual.temperature = reading.temperature;
    residuals.push_back(std::move(residual));
  }
  return residuals;
}

}  // namespace axiscal
