// SPDX-License-Identifier: Apache-2.0
// Published calibrations of IMUs from logs of rests and turns.
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <sstream>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>

#include "axiscal/calib/magnitude_fit.hpp"
#include "axiscal/calib/turns.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/logs/imu.hpp"
#include "axiscal/logs/segment.hpp"
#include "data.hpp"
#include "kernels/sliding_variance.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

RecordedLog recorded(const std::string& path, const LogFormat& format = {}) {
  LogFile file(path, format);
  RecordedLog log{.name = path, .columns = file.columns()};
  log.samples = read_log(file);
  return log;
}

Eigen::Vector3d sample_of(const RecordedLog& log, std::size_t first_column, std::size_t i) {
  return {log.samples[first_column][i], log.samples[first_column + 1][i],
          log.samples[first_column + 2][i]};
}

Eigen::Vector3d mean_of(const RecordedLog& log,
                        std::size_t first_column,
                        std::size_t first,
                        std::size_t end) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = first; i < end; ++i) {
    sum += sample_of(log, first_column, i);
  }
  return sum / static_cast<double>(end - first);
}

GyroscopeTurn turn_of(const RecordedLog& log,
                      std::size_t first_column,
                      std::span<const double> time_s,
                      std::size_t first,
                      std::size_t count) {
  GyroscopeTurn turn;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    turn.readings[axis] = std::span(log.samples[first_column + axis]).subspan(first, count);
  }
  turn.time_s = time_s.subspan(first, count);
  return turn;
}

// ---- imu_tk's own recording ----

// The rests by imu_tk's rule: a window of 101 samples, a variance below six times that of the first
// 50 s, and at least 100 samples.
class Xsens : public testing::Test {
 protected:
  static constexpr double g = 9.81744;

  void SetUp() override {
    AXISCAL_NEED_DATA(path, "imu_xsens_mti_imu_tk/xsens_acc_gyro.csv");
    log_ = recorded(path);
    constexpr std::size_t half = 50;
    const std::size_t n = log_.samples[0].size();
    const std::array<std::span<const double>, 3> acc = {log_.samples[1], log_.samples[2],
                                                        log_.samples[3]};
    std::vector<double> joined(n - 2 * half);
    joined_sliding_variance(acc, 2 * half + 1, joined);
    const std::array<std::span<const double>, 3> start = {acc[0].first(5001), acc[1].first(5001),
                                                          acc[2].first(5001)};
    std::vector<double> first(1);
    joined_sliding_variance(start, 5001, first);
    threshold_ = 6.0 * std::sqrt(first[0]);
    EXPECT_NEAR(std::sqrt(first[0]), 18.9330074, 1e-6);  // computed by numpy
    std::size_t begin = n;
    for (std::size_t i = half; i + half < n; ++i) {
      const bool still = std::sqrt(joined[i - half]) < threshold_;
      if (still && begin == n) {
        begin = i;
      } else if (begin < n && (!still || i + half + 1 == n)) {
        if (i - begin >= 100) {
          rests_.emplace_back(begin, i);
        }
        begin = n;
      }
    }
  }

  RecordedLog log_;
  double threshold_ = 0.0;
  std::vector<std::pair<std::size_t, std::size_t>> rests_;
};

// imu_tk's published parameters, and standard errors by numpy for the same 3800 samples.
TEST_F(Xsens, AccelerometerAgreesWithImuTk) {
  ASSERT_EQ(rests_.size(), 38U);
  Eigen::MatrixX3d samples(3800, 3);
  for (std::size_t r = 0; r < rests_.size(); ++r) {
    for (std::size_t i = 0; i < 100; ++i) {
      samples.row(static_cast<Eigen::Index>(100 * r + i)) =
          sample_of(log_, 1, rests_[r].first + i).transpose();
    }
  }
  const MagnitudeFit fit = fit_magnitude(samples, g, MagnitudeShape::triangular);
  const Eigen::Matrix3d A = Eigen::Matrix3d(fit.response.sensitivity).inverse();
  const Eigen::Vector3d scales(2.412784625e-3, 2.427122767e-3, 2.411680239e-3);
  const Eigen::Vector3d scale_se(1.1104e-7, 5.8861e-8, 6.5884e-8);
  const Eigen::Vector3d biases(33124.1826, 33275.1794, 32364.41565);
  const Eigen::Vector3d bias_se(0.17414, 0.097598, 0.10653);
  for (int k = 0; k < 3; ++k) {
    // A = T K. Column k of A has the scale k as a factor.
    EXPECT_NEAR(A(k, k), scales(k), 0.1 * scale_se(k)) << k;
    EXPECT_NEAR(fit.response.bias(k), biases(k), 0.1 * bias_se(k)) << k;
  }
  // T = [1 -a_yz a_zy; 0 1 -a_zx; 0 0 1] gives a_yz, a_zy and a_zx.
  EXPECT_NEAR(-A(0, 1) / A(1, 1), 3.359296037e-3, 0.1 * 9.4853e-5);
  EXPECT_NEAR(A(0, 2) / A(2, 2), -8.906423672e-3, 0.1 * 3.3798e-4);
  EXPECT_NEAR(-A(1, 2) / A(2, 2), 2.133413259e-2, 0.1 * 8.5061e-5);
  EXPECT_NEAR(fit.residual_sd, 7.9610e-3, 2e-6);
}

// Means of each still second of the whole recording. The residual of imu_tk's parameters is 1.88
// mm/s^2.
TEST_F(Xsens, OneSecondMeansFitNoWorseThanImuTks) {
  ASSERT_EQ(rests_.size(), 38U);
  ImuOptions options;
  options.accelerometer = {"acc_x", "acc_y", "acc_z"};
  options.gyroscope = {"gyr_x", "gyr_y", "gyr_z"};
  options.experiment.field.unit = "m/s^2";
  options.experiment.field.magnitude = g;
  options.experiment.fit.shape = MagnitudeShape::triangular;
  const ImuCalibration imu = calibrate_imu(log_, options);
  const Eigen::Matrix3d A =
      Eigen::Matrix3d(imu.accelerometer.sensor.response.sensitivity).inverse();
  double squares = 0.0;
  int seconds = 0;
  for (std::size_t first = 0; first + 100 <= log_.samples[0].size(); first += 100) {
    const std::array<std::span<const double>, 3> block = {
        std::span(log_.samples[1]).subspan(first, 100),
        std::span(log_.samples[2]).subspan(first, 100),
        std::span(log_.samples[3]).subspan(first, 100)};
    std::vector<double> joined(1);
    joined_sliding_variance(block, 100, joined);
    if (std::sqrt(joined[0]) < threshold_) {
      const Eigen::Vector3d mean = mean_of(log_, 1, first, first + 100);
      squares += std::pow((A * (mean - imu.accelerometer.sensor.response.bias)).norm() - g, 2);
      ++seconds;
    }
  }
  EXPECT_EQ(seconds, 326);
  EXPECT_LE(std::sqrt(squares / seconds), 1.88e-3);
  EXPECT_LT(imu.turns->residual_sd_rad * deg_per_rad, 0.4);  // degrees a turn; imu_tk: 0.52
}

TEST_F(Xsens, GyroscopeAgreesWithImuTk) {
  ASSERT_EQ(rests_.size(), 38U);
  // The parameters of imu_tk's accelerometer, and the gyroscope's bias in the first 50 s.
  Eigen::Matrix3d A;
  const Eigen::Vector3d s(2.412784625e-3, 2.427122767e-3, 2.411680239e-3);
  A << s(0), -3.359296037e-3 * s(1), -8.906423672e-3 * s(2), 0.0, s(1), -2.133413259e-2 * s(2), 0.0,
      0.0, s(2);
  const Eigen::Vector3d b(33124.1826, 33275.1794, 32364.41565);
  const Eigen::Vector3d bias = mean_of(log_, 4, 0, 5001);
  EXPECT_MATRIX_NEAR(bias, Eigen::Vector3d(32777.13997201, 32459.81163767, 32511.84243151), 1e-7);
  std::vector<GyroscopeTurn> turns;
  for (std::size_t r = 0; r + 1 < rests_.size(); ++r) {
    const auto [first, end] = rests_[r];
    GyroscopeTurn turn = turn_of(log_, 4, log_.samples[0], end, rests_[r + 1].first - end);
    turn.up_before = A * (mean_of(log_, 1, first, end + 1) - b);
    turn.up_after = A * (mean_of(log_, 1, rests_[r + 1].first, rests_[r + 1].second + 1) - b);
    turns.push_back(turn);
  }
  const TurnFit fit = fit_turns(turns, {.bias = bias}, {.rate_per_unit = 1.0 / 6258});
  // Results of numpy and Ceres for the same turns, with standard errors. The published scales
  // differ by less than 1e-8.
  Eigen::Matrix3d B;
  B << 2.0929502144e-04, 1.2495812681e-06, 2.3243916307e-07, 1.6931451426e-06, 2.0990052362e-04,
      -1.1214707013e-05, 5.3019455451e-06, -5.3771067750e-07, 2.0948647862e-04;
  Eigen::Matrix3d se;
  se << 1.3671e-07, 1.9936e-07, 2.3828e-07, 2.0191e-07, 1.2957e-07, 2.8851e-07, 2.2361e-07,
      2.0996e-07, 1.9375e-07;
  for (int p = 0; p < 3; ++p) {
    for (int q = 0; q < 3; ++q) {
      EXPECT_NEAR(fit.inverse(p, q), B(p, q), 0.1 * se(p, q)) << p << q;
    }
  }
  double cost = 0.0;
  for (const Eigen::Vector3d& residual : fit.residuals) {
    cost += 0.5 * residual.squaredNorm();
  }
  EXPECT_NEAR(cost, 1.502238681e-3, 2e-6);
  EXPECT_NEAR(fit.inverse(0, 0), 2.09295e-4, 1e-8);
  EXPECT_NEAR(fit.inverse(1, 1), 2.09899e-4, 1e-8);
  EXPECT_NEAR(fit.inverse(2, 2), 2.09483e-4, 1e-8);
}

// ---- MPU-9150, ICINS 2020 ----

// Rests by the rule in the authors' code: |w| below 0.13 rad/s, without 60 samples on both sides of
// a motion.
std::vector<std::pair<std::size_t, std::size_t>> still_by_rate(const RecordedLog& log) {
  const std::size_t n = log.samples[0].size();
  std::vector<char> still(n, 0);
  std::size_t quiet = 60;
  for (std::size_t i = 0; i < n; ++i) {
    if (sample_of(log, 3, i).norm() < 0.13) {
      still[i] = ++quiet > 60 ? 1 : 0;
    } else {
      quiet = 0;
      for (std::size_t j = i < 60 ? 0 : i - 60; j <= i; ++j) {
        still[j] = 0;
      }
    }
  }
  std::vector<std::pair<std::size_t, std::size_t>> rests;
  for (std::size_t i = 0; i < n; ++i) {
    if (still[i] != 0 && (i == 0 || still[i - 1] == 0)) {
      rests.emplace_back(i, i);
    }
    if (still[i] != 0) {
      rests.back().second = i + 1;
    }
  }
  return rests;
}

class Icins : public testing::TestWithParam<int> {};

TEST_P(Icins, AgreesWithThePublishedTable) {
  const std::string folder = "imu_mpu9150_icins2020/";
  AXISCAL_NEED_DATA(path, folder + "imu" + std::to_string(GetParam()) + ".log");
  AXISCAL_NEED_DATA(table_path, folder + "published_table.csv");
  std::map<std::string, std::vector<double>> published;
  std::ifstream file(table_path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream cells(line);
    std::string imu, sensor;
    std::getline(cells, imu, ',');
    std::getline(cells, sensor, ',');
    if (imu == std::to_string(GetParam())) {
      for (std::string cell; std::getline(cells, cell, ',') && !cell.empty();) {
        published[sensor].push_back(std::stod(cell));
      }
    }
  }
  const RecordedLog log = recorded(path, {.names = {"ax", "ay", "az", "gx", "gy", "gz"}});
  const auto rests = still_by_rate(log);
  ASSERT_GE(rests.size(), 20U);
  Eigen::MatrixX3d means(static_cast<Eigen::Index>(rests.size()), 3);
  for (std::size_t r = 0; r < rests.size(); ++r) {
    means.row(static_cast<Eigen::Index>(r)) =
        mean_of(log, 0, rests[r].first, rests[r].second).transpose();
  }
  const MagnitudeFit fit = fit_magnitude(means, 9.81, MagnitudeShape::triangular);
  const Eigen::Matrix3d S = fit.response.sensitivity;
  const std::array<double, 9> acc = {
      100.0 * (S(0, 0) - 1.0), 100.0 * (S(1, 1) - 1.0), 100.0 * (S(2, 2) - 1.0),
      S(1, 2) * deg_per_rad,   S(0, 1) * deg_per_rad,   S(0, 2) * deg_per_rad,
      fit.response.bias(0),    fit.response.bias(1),    fit.response.bias(2)};
  for (std::size_t p = 0; p < acc.size(); ++p) {
    EXPECT_NEAR(acc[p], published.at("acc")[p], 0.03) << "accelerometer " << p;
  }

  // Motions are extended by five samples. The directions are means of all samples between motions.
  std::vector<double> time_s(log.samples[0].size());
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    time_s[i] = 0.01 * static_cast<double>(i);
  }
  const Eigen::Matrix3d A = S.inverse();
  std::vector<GyroscopeTurn> turns;
  std::size_t from = 0;
  for (std::size_t r = 0; r + 1 < rests.size(); ++r) {
    const std::size_t first = rests[r].second - 5;
    const std::size_t end = rests[r + 1].first + 5;
    const std::size_t to =
        r + 2 < rests.size() ? rests[r + 1].second - 5 : log.samples[0].size() - 1;
    GyroscopeTurn turn = turn_of(log, 3, time_s, first, end - first);
    turn.up_before = A * (mean_of(log, 0, from, first) - fit.response.bias);
    turn.up_after = A * (mean_of(log, 0, end, to) - fit.response.bias);
    turns.push_back(turn);
    from = end;
  }
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  for (const auto& [first, end] : rests) {
    bias += mean_of(log, 3, first, end) / static_cast<double>(rests.size());
  }
  // The bias changes between their rests by 0.03 to 0.05 deg/s, so the authors fit it too. They use
  // equal weights for all turns.
  const TurnFit gyro = fit_turns(turns, {.bias = bias},
                                 {.rate_per_unit = 1.0, .fit_bias = true, .whole_budget = false});
  // S = (1 + [e x]) M with an upper triangular M.
  Eigen::Vector3d e = Eigen::Vector3d::Zero();
  Eigen::Matrix3d M = gyro.response.sensitivity;
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  for (int round = 0; round < 50; ++round) {
    turned << 1.0, -e(2), e(1), e(2), 1.0, -e(0), -e(1), e(0), 1.0;
    M = turned.inverse() * gyro.response.sensitivity;
    e += Eigen::Vector3d(M(2, 1) / M(1, 1), -M(2, 0) / M(0, 0), M(1, 0) / M(0, 0));
  }
  const Eigen::Vector3d w0 = turned.inverse() * gyro.response.bias;
  const std::array<double, 12> gyr = {
      100.0 * (M(0, 0) - 1.0), 100.0 * (M(1, 1) - 1.0), 100.0 * (M(2, 2) - 1.0),
      M(1, 2) * deg_per_rad,   M(0, 1) * deg_per_rad,   M(0, 2) * deg_per_rad,
      w0(0) * deg_per_rad,     w0(1) * deg_per_rad,     w0(2) * deg_per_rad,
      e(0) * deg_per_rad,      e(1) * deg_per_rad,      e(2) * deg_per_rad};
  for (std::size_t p = 0; p < gyr.size(); ++p) {
    EXPECT_NEAR(gyr[p], published.at("gyr")[p], 0.05) << "gyroscope " << p;
  }
}

INSTANTIATE_TEST_SUITE_P(Units, Icins, testing::Values(0, 1, 2));

// ---- MPU-6050, uncuyo ----

TEST(Uncuyo, IntervalMeansAndFit) {
  AXISCAL_NEED_DATA(path, "imu_mpu6050_uncuyo/calibration_log.csv");
  AXISCAL_NEED_DATA(intervals_path, "imu_mpu6050_uncuyo/static_intervals.csv");
  AXISCAL_NEED_DATA(means_path, "imu_mpu6050_uncuyo/calibrated_accel_avg_data.csv");
  AXISCAL_NEED_DATA(parameters_path, "imu_mpu6050_uncuyo/params_acc.csv");
  const RecordedLog log = recorded(path);
  EXPECT_EQ(log.columns.front(), "ax");  // the reader skips 4 lines before the header
  ASSERT_EQ(log.samples[0].size(), 10245U);
  LogFile intervals_file(intervals_path);
  const LogBlock intervals = read_log(intervals_file);
  LogFile means_file(means_path);
  const LogBlock published = read_log(means_file);
  LogFile parameters_file(parameters_path, {.names = {"p"}});
  const std::vector<double> p = read_log(parameters_file)[0];
  Eigen::Matrix3d T;
  T << 1.0, -p[0], p[1], 0.0, 1.0, -p[2], 0.0, 0.0, 1.0;
  const Eigen::Matrix3d A = T * Eigen::Vector3d(p[3], p[4], p[5]).asDiagonal();
  const Eigen::Vector3d b(-p[6], -p[7], -p[8]);
  Eigen::MatrixX3d means(10, 3);
  double published_cost = 0.0;
  for (Eigen::Index r = 0; r < 10; ++r) {
    const auto i = static_cast<std::size_t>(r);
    means.row(r) = mean_of(log, 0, static_cast<std::size_t>(intervals[i][0]),
                           static_cast<std::size_t>(intervals[i][1]))
                       .transpose();
    const Eigen::Vector3d calibrated = A * (means.row(r).transpose() - b);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(calibrated(static_cast<Eigen::Index>(axis)), published[axis][i], 1e-6);
    }
    published_cost += std::pow(calibrated.norm() - 9.81, 2);
  }
  const MagnitudeFit fit = fit_magnitude(means, 9.81, MagnitudeShape::triangular);
  EXPECT_LE(fit.residual_sd * fit.residual_sd * fit.degrees_of_freedom, published_cost);
}

}  // namespace
}  // namespace axiscal
