// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "axiscal/calib/history.hpp"
#include "axiscal/calib/method_kind.hpp"

namespace axiscal {
namespace {

bool counts_for(const Calibration& record, const Instrument& instrument) {
  const Instrument& own = record.sensor.instrument;
  const bool same_unit = !instrument.serial.empty() && own.serial == instrument.serial;
  const bool same_model = !instrument.model.empty() && own.model == instrument.model;
  const bool by_table = method_kind(record.fit.method).by_pose;
  return by_table && record.findings.status != CalibrationStatus::refused &&
         own.kind == instrument.kind && own.axes == instrument.axes &&
         own.unit == instrument.unit && (same_unit || same_model);
}

}  // namespace

std::optional<ProcessScatter> process_scatter(const std::vector<Calibration>& records,
                                              const Instrument& instrument,
                                              const std::vector<InputFileDigest>& leave_out) {
  const Eigen::Index m = instrument.axis_count();
  ProcessScatter scatter{.mean_square = Eigen::VectorXd::Zero(m)};
  // For each serial number, the biases in its records that contain only one block.
  std::map<std::string, std::vector<Eigen::VectorXd>> of_one_block;
  std::vector<InputFileDigest> seen = leave_out;
  for (const Calibration& record : records) {
    if (!counts_for(record, instrument) || is_made_from(record, seen)) {
      continue;  // the record is not suitable, or its readings were used already
    }
    seen.insert(seen.end(), record.provenance.inputs.begin(), record.provenance.inputs.end());
    const CalibrationConditions& conditions = record.fit.conditions;
    if (conditions.block_mean_square.size() == m && conditions.block_degrees_of_freedom > 0.0) {
      scatter.mean_square += conditions.block_degrees_of_freedom * conditions.block_mean_square;
      scatter.degrees_of_freedom += conditions.block_degrees_of_freedom;
      ++scatter.records;
    } else if (record.sensor.response.bias.size() == m) {
      of_one_block[record.sensor.instrument.serial].push_back(record.sensor.response.bias);
    }
  }
  for (const auto& [serial, biases] : of_one_block) {
    if (biases.size() < 2 || serial.empty()) {
      continue;
    }
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(m);
    for (const Eigen::VectorXd& bias : biases) {
      mean += bias / static_cast<double>(biases.size());
    }
    for (const Eigen::VectorXd& bias : biases) {
      scatter.mean_square += (bias - mean).cwiseAbs2();
    }
    scatter.degrees_of_freedom += static_cast<double>(biases.size() - 1);
    scatter.records += static_cast<int>(biases.size());
  }
  if (!(scatter.degrees_of_freedom > 0.0)) {
    return std::nullopt;
  }
  scatter.mean_square /= scatter.degrees_of_freedom;
  return scatter;
}

}  // namespace axiscal
