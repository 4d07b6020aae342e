// SPDX-License-Identifier: Apache-2.0
// Published calibrations, recomputed from their published readings.
#include <fstream>
#include <map>
#include <sstream>

#include <nlohmann/json.hpp>

#include "axiscal/calib/calibrate.hpp"
#include "data.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

std::vector<std::vector<double>> read_numbers(const std::string& path, std::size_t header_lines) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  std::size_t line_number = 0;
  for (std::string line; std::getline(file, line); ++line_number) {
    if (line_number < header_lines) {
      continue;
    }
    std::vector<double> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      row.push_back(std::strtod(cell.c_str(), nullptr));
    }
    rows.push_back(row);
  }
  return rows;
}

Experiment known_experiment() {
  Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field.of = make_field("gravity");
  experiment.fit.method = Method::known;
  return experiment;
}

// W. Ward, honours thesis, University of Central Arkansas (2023): MPU-9250 in six positions.
class SixPositions : public testing::TestWithParam<std::string> {};

TEST_P(SixPositions, AgreeWithTheThesis) {
  AXISCAL_NEED_DATA(readings, "accel_six_position_uca/six_position_data_" + GetParam() + ".csv");
  AXISCAL_NEED_DATA(published, "accel_six_position_uca/optim_params_" + GetParam() + ".csv");
  Observations observations;
  const std::vector<std::vector<double>> rows = read_numbers(readings, 1);
  ASSERT_EQ(rows.size(), 6U);
  observations.response.resize(6, 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    observations.readings.push_back(
        {.run = static_cast<int>(i) + 1,
         .field_in_sensor = Eigen::Vector3d(rows[i][0], rows[i][3], rows[i][6])});
    observations.response.row(static_cast<Eigen::Index>(i)) << rows[i][1], rows[i][4], rows[i][7];
  }
  const Calibration calibration = calibrate(known_experiment(), observations);
  const std::vector<double> p = read_numbers(published, 2).at(2);
  // The published biases are an optimiser's. They agree with the least-squares solution to 1e-10.
  EXPECT_MATRIX_NEAR(calibration.sensor.response.bias, Eigen::Vector3d(p[0], p[1], p[2]), 1e-10);
  EXPECT_MATRIX_NEAR(calibration.sensor.response.sensitivity,
                     Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix3d>(&p[3]).transpose()), 1e-12);
  EXPECT_EQ(calibration.findings.status, CalibrationStatus::ok)
      << "honest residuals are no mistakes";
  // The same readings with labels. The search for mistakes examines only labelled readings.
  for (Reading& reading : observations.readings) {
    Eigen::Index axis = 0;
    reading.field_in_sensor->cwiseAbs().maxCoeff(&axis);
    const bool up = (*reading.field_in_sensor)(axis) > 0.0;
    const auto number = static_cast<int>(axis);
    reading.point = DesignPoint(face_of(number, !up), face_of((number + 1) % 3, true));
    reading.field_in_sensor.reset();
  }
  EXPECT_EQ(calibrate(known_experiment(), observations).findings.status, CalibrationStatus::ok);
}

// Thesis table A-3, trial 1: relative standard errors of the fit with weights 1 / sd^2.
TEST(SixPositionsWeighted, AgreeWithTheThesis) {
  AXISCAL_NEED_DATA(readings, "accel_six_position_uca/six_position_data_1.csv");
  Observations observations;
  const std::vector<std::vector<double>> rows = read_numbers(readings, 1);
  observations.response.resize(6, 3);
  observations.response_sd = Eigen::MatrixXd(6, 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    observations.readings.push_back(
        {.run = static_cast<int>(i) + 1,
         .field_in_sensor = Eigen::Vector3d(rows[i][0], rows[i][3], rows[i][6])});
    observations.response.row(row) << rows[i][1], rows[i][4], rows[i][7];
    observations.response_sd->row(row) << rows[i][2], rows[i][5], rows[i][8];
  }
  Experiment experiment = known_experiment();
  experiment.fit.weighting = Weighting::sd;
  const Calibration calibration = calibrate(experiment, observations);
  const SensitivityMatrix& S = calibration.sensor.response.sensitivity;
  const FitStatistics& statistics = *calibration.fit.statistics;
  EXPECT_NEAR(S(0, 0), 1.00005635, 5e-9);
  EXPECT_NEAR(S(0, 1), 0.00797754, 5e-9);
  EXPECT_NEAR(S(0, 2), 0.00860328, 5e-9);
  EXPECT_NEAR(calibration.sensor.response.bias(0), 0.09155981, 5e-9);
  EXPECT_NEAR(S(2, 2), 1.02195926, 5e-9);
  EXPECT_NEAR(calibration.sensor.response.bias(2), -0.25009793, 5e-9);
  EXPECT_NEAR(100.0 * statistics.sensitivity_se(0, 0) / S(0, 0), 0.166, 6e-4);
  EXPECT_NEAR(100.0 * statistics.sensitivity_se(0, 1) / S(0, 1), 8.5, 0.06);
  EXPECT_NEAR(100.0 * statistics.sensitivity_se(2, 2) / S(2, 2), 0.105, 6e-4);
  EXPECT_EQ(calibration.findings.status, CalibrationStatus::ok);
}

INSTANTIATE_TEST_SUITE_P(Trials, SixPositions, testing::Values("1", "2"));

// Kuederle et al., imucal (JOSS 2022): Ferraris's six static positions.
TEST(Ferraris, MatrixIsTheRegressions) {
  AXISCAL_NEED_DATA(session, "imu_ferraris_imucal/annotated_session.csv");
  AXISCAL_NEED_DATA(snapshot, "imu_ferraris_imucal/example_cal.json");
  const std::vector<std::string> parts = {"x_p", "x_a", "y_p", "y_a", "z_p", "z_a"};
  std::map<std::string, std::pair<Eigen::Vector3d, double>> sums;
  std::ifstream file(session);
  for (std::string line; std::getline(file, line);) {
    const std::vector<std::string> cells = test::csv_cells(line).at(0);
    auto& [sum, count] = sums.try_emplace(cells[0], Eigen::Vector3d::Zero(), 0.0).first->second;
    sum += Eigen::Vector3d(std::strtod(cells[2].c_str(), nullptr),
                           std::strtod(cells[3].c_str(), nullptr),
                           std::strtod(cells[4].c_str(), nullptr));
    count += 1.0;
  }
  constexpr double g = 9.81;  // [m/s^2], the value in imucal
  Observations observations;
  observations.response.resize(6, 3);
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto& [sum, count] = sums.at(parts[static_cast<std::size_t>(i)]);
    observations.response.row(i) = sum / count;
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    observations.readings.push_back({.run = static_cast<int>(i) + 1,
                                     .field_in_sensor = sign * g * Eigen::Vector3d::Unit(i / 2)});
  }
  Experiment experiment = known_experiment();
  experiment.field.unit = "m/s^2";
  experiment.field.magnitude = g;
  const Calibration calibration = calibrate(experiment, observations);

  const nlohmann::json expected = test::read_json(snapshot);
  Eigen::Matrix3d K;
  Eigen::Matrix3d R;
  Eigen::Vector3d bias;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    bias(row) = expected["b_a"][i];
    for (std::size_t j = 0; j < 3; ++j) {
      K(row, static_cast<Eigen::Index>(j)) = expected["K_a"][i][j];
      R(row, static_cast<Eigen::Index>(j)) = expected["R_a"][i][j];
    }
  }
  const Eigen::Matrix3d S = K * R;
  EXPECT_MATRIX_NEAR(calibration.sensor.response.sensitivity, S, 1e-12 * S.norm());

  // Ferraris' bias of an axis is from the two positions along it. Ours is from all six positions.
  Eigen::Vector3d his;
  for (Eigen::Index k = 0; k < 3; ++k) {
    his(k) = 0.5 * (observations.response(2 * k, k) + observations.response(2 * k + 1, k));
  }
  EXPECT_MATRIX_NEAR(his, bias, 1e-11);
  const Eigen::Vector3d all = observations.response.colwise().mean();
  EXPECT_MATRIX_NEAR(calibration.sensor.response.bias, all, 1e-11);
  const Eigen::Vector3d apart = calibration.sensor.response.bias - his;
  std::printf("regression less Ferraris [counts]: %.3f %.3f %.3f; standard errors %.3f %.3f %.3f\n",
              apart.x(), apart.y(), apart.z(), calibration.fit.statistics->bias_se(0),
              calibration.fit.statistics->bias_se(1), calibration.fit.statistics->bias_se(2));
}

}  // namespace
}  // namespace axiscal
