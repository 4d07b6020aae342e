// SPDX-License-Identifier: Apache-2.0
// A program that takes the place of imu_tk in comparisons of speed. It performs the same steps with
// the same tools (Ceres, automatic differentiation).
//
//   g++ -O2 -std=c++20 -I/usr/include/eigen3 imu_tk_stand_in.cpp -o imu_tk_stand_in -lceres -lglog
//   taskset -c 0 ./imu_tk_stand_in xsens_acc_gyro.csv [rounds]
//
// Written from the published method, not from imu_tk's source text: D. Tedaldi, A. Pretto and
// E. Menegatti, "A Robust and Easy to Implement Method for IMU Calibration without External
// Equipments", ICRA 2014, 3042-3049.
//
// The slow parts of imu_tk are kept: the variance is computed again for each threshold, the whole
// recording is copied for each gyroscope residual, and 4x4 matrices of Jets (Ceres's numbers with
// derivatives) are multiplied at every step of the integration.
#include <algorithm>
#include <array>
#include <ceres/ceres.h>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace {

using Parameters = std::array<double, 9>;

constexpr double gravity = 9.81744;      // [m/s^2], at the site of imu_tk's authors
constexpr double initial_rest_s = 50.0;  // duration of the static interval at the start
constexpr std::size_t window = 101;      // samples in the window of the sliding variance
constexpr std::size_t samples_per_interval = 100;
// A threshold is k times the variance of the initial rest, with k from first_multiplier to
// last_multiplier.
constexpr int first_multiplier = 2;
constexpr int last_multiplier = 10;
// Start values of imu_tk's authors: misalignments, scales [unit per count], biases [counts].
constexpr Parameters accelerometer_start = {0, 0, 0, 1, 1, 1, 32768, 32768, 32768};
constexpr Parameters gyroscope_start = {0, 0, 0, 0, 0, 0, 1 / 6258., 1 / 6258., 1 / 6258.};

/// One simultaneous reading of three axes.
template <typename T>
struct Sample {
  double time_s = 0.0;
  Eigen::Vector3<T> value = Eigen::Vector3<T>::Zero();
};
using Samples = std::vector<Sample<double>>;

/// The samples from `first` to `last`, both included.
struct Interval {
  std::size_t first = 0;
  std::size_t last = 0;
  [[nodiscard]] std::size_t size() const { return last - first + 1; }
};
using Intervals = std::vector<Interval>;

struct Record {
  Samples accelerometer;
  Samples gyroscope;
};

Record read_record(const char* path) {
  std::ifstream file(path);
  std::string header;
  std::getline(file, header);
  Record record;
  double t = 0.0;
  Eigen::Vector3d a, w;
  char comma = ',';
  while (file >> t >> comma >> a[0] >> comma >> a[1] >> comma >> a[2] >> comma >> w[0] >> comma >>
         w[1] >> comma >> w[2]) {
    record.accelerometer.push_back({t, a});
    record.gyroscope.push_back({t, w});
  }
  if (record.gyroscope.empty() || !file.eof()) {
    throw std::runtime_error(std::string("cannot read ") + path);
  }
  return record;
}

// ---- Static detection ----

Eigen::Vector3d mean(const Samples& samples, const Interval& interval) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = interval.first; i <= interval.last; ++i) {
    sum += samples[i].value;
  }
  return sum / static_cast<double>(interval.size());
}

Eigen::Vector3d variance(const Samples& samples, const Interval& interval) {
  const Eigen::Vector3d centre = mean(samples, interval);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = interval.first; i <= interval.last; ++i) {
    const Eigen::Vector3d difference = samples[i].value - centre;
    sum += difference.cwiseProduct(difference);
  }
  return sum / static_cast<double>(interval.size() - 1);
}

/// Returns the first `initial_rest_s` seconds. The sample at the end is included, because imu_tk's
/// results are reproduced only with it.
Interval initial_interval(const Samples& samples) {
  const double end_s = samples.front().time_s + initial_rest_s;
  std::size_t last = 0;
  while (last + 1 < samples.size() && samples[last].time_s < end_s) {
    ++last;
  }
  return {0, last};
}

/// Returns the intervals of at least `samples_per_interval` samples in which the instrument is at
/// rest. At every sample of an interval, the norm of the sliding variances of the three axes is
/// below `threshold`.
Intervals static_intervals(const Samples& samples, double threshold) {
  constexpr std::size_t half = window / 2;
  Intervals intervals;
  std::size_t length = 0;  // length of the static interval that ends just before sample i
  for (std::size_t i = half; i + half <= samples.size(); ++i) {
    const bool still =
        i + half < samples.size() && variance(samples, {i - half, i + half}).norm() < threshold;
    if (!still && length >= samples_per_interval) {
      intervals.push_back({i - length, i - 1});
    }
    length = still ? length + 1 : 0;
  }
  return intervals;
}

// ---- Sensor model: calibrated = T K (raw - b) ----

/// Returns the product T K with T = [1 -yz zy; xz 1 -zx; -xy yx 1] and the diagonal matrix K of the
/// scales.
template <typename T>
Eigen::Matrix3<T> model_matrix(const std::array<T, 6>& misalignment, const T* scale) {
  const auto& [yz, zy, xz, zx, xy, yx] = misalignment;
  Eigen::Matrix3<T> skew;
  skew << T(1.0), -yz, zy, xz, T(1.0), -zx, -xy, yx, T(1.0);
  Eigen::Matrix3<T> diagonal = Eigen::Matrix3<T>::Zero();
  diagonal.diagonal() << scale[0], scale[1], scale[2];
  return skew * diagonal;
}

/// Returns the calibrated specific force.
/// @param p  the misalignments yz, zy, zx, then three scales, then three biases. The axis x of the
///           calibrated frame is the sensor's axis x. The plane xy of the calibrated frame is the
///           plane of the sensor's axes x and y.
template <typename T>
Eigen::Vector3<T> calibrated_accelerometer(const T* p, const Eigen::Vector3d& raw) {
  const Eigen::Matrix3<T> matrix =
      model_matrix<T>({p[0], p[1], T(0.0), p[2], T(0.0), T(0.0)}, p + 3);
  return matrix * (raw.cast<T>() - Eigen::Map<const Eigen::Vector3<T>>(p + 6));
}

// ---- Accelerometer ----

struct MagnitudeResidual {
  Eigen::Vector3d raw;

  template <typename T>
  bool operator()(const T* parameters, T* residual) const {
    residual[0] = T(gravity) - calibrated_accelerometer(parameters, raw).norm();
    return true;
  }
};

struct Fit {
  double cost = 0.0;  // half the sum of squared residuals (convention of Ceres)
  Parameters parameters{};
};

double least_cost(ceres::Problem* problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  if (!summary.IsSolutionUsable()) {
    throw std::runtime_error(summary.BriefReport());
  }
  return summary.final_cost;
}

Fit fit_accelerometer(const Samples& samples, const Intervals& rests) {
  Fit fit{.parameters = accelerometer_start};
  ceres::Problem problem;
  for (const Interval& rest : rests) {
    for (std::size_t i = rest.first; i < rest.first + samples_per_interval; ++i) {
      auto* cost = new ceres::AutoDiffCostFunction<MagnitudeResidual, 1, 9>(
          new MagnitudeResidual{samples[i].value});
      problem.AddResidualBlock(cost, nullptr, fit.parameters.data());
    }
  }
  fit.cost = least_cost(&problem);
  return fit;
}

// ---- Gyroscope ----

/// Returns the matrix A of the differential equation dq/dt = A q of a quaternion q.
/// @param w  angular rate in the rotating frame.
template <typename T>
Eigen::Matrix4<T> rate_matrix(const Eigen::Vector3<T>& w) {
  Eigen::Matrix4<T> matrix;
  matrix << T(0.0), -w[0], -w[1], -w[2],  //
      w[0], T(0.0), w[2], -w[1],          //
      w[1], -w[2], T(0.0), w[0],          //
      w[2], w[1], -w[0], T(0.0);
  return matrix * T(0.5);
}

/// Performs one Runge-Kutta step of fourth order. The rate is linear between the ends of the step.
template <typename T>
Eigen::Vector4<T> rk4_step(const Eigen::Vector4<T>& q, const Sample<T>& a, const Sample<T>& b) {
  const T step(b.time_s - a.time_s);
  const T half_step = step * T(0.5);
  const Eigen::Vector3<T> middle_rate = (a.value + b.value) * T(0.5);
  const Eigen::Matrix4<T> middle = rate_matrix<T>(middle_rate);
  const Eigen::Vector4<T> k1 = rate_matrix<T>(a.value) * q;
  const Eigen::Vector4<T> k2 = middle * (q + k1 * half_step);
  const Eigen::Vector4<T> k3 = middle * (q + k2 * half_step);
  const Eigen::Vector4<T> k4 = rate_matrix<T>(b.value) * (q + k3 * step);
  const Eigen::Vector4<T> next = q + (k1 + k2 * T(2.0) + k3 * T(2.0) + k4) * (step / T(6.0));
  return next / next.norm();
}

/// The residual of a motion. It is the direction of gravity before the motion, rotated by the
/// integrated rates, minus the direction of gravity after the motion.
struct MotionResidual {
  Eigen::Vector3d versor_before;
  Eigen::Vector3d versor_after;
  Samples record;  // rates minus bias; each residual has its own copy, because imu_tk copies them
  Interval motion;

  template <typename T>
  bool operator()(const T* p, T* residual) const {
    const Eigen::Matrix3<T> matrix = model_matrix<T>({p[0], p[1], p[2], p[3], p[4], p[5]}, p + 6);
    std::vector<Sample<T>> rates;
    rates.reserve(motion.size());
    for (std::size_t i = motion.first; i <= motion.last; ++i) {
      const Eigen::Vector3<T> raw = record[i].value.cast<T>();
      rates.push_back({record[i].time_s, matrix * raw});
    }
    Eigen::Vector4<T> q(T(1.0), T(0.0), T(0.0), T(0.0));
    for (std::size_t i = 0; i + 1 < rates.size(); ++i) {
      q = rk4_step<T>(q, rates[i], rates[i + 1]);
    }
    const Eigen::Quaternion<T> turn(q[0], q[1], q[2], q[3]);
    Eigen::Map<Eigen::Vector3<T>> error(residual);
    error = turn.toRotationMatrix().transpose() * versor_before.cast<T>() - versor_after.cast<T>();
    return true;
  }
};

Fit fit_gyroscope(const Record& record, const Intervals& rests, const Parameters& accelerometer) {
  Samples rates = record.gyroscope;
  const Eigen::Vector3d bias = mean(rates, initial_interval(rates));
  for (Sample<double>& rate : rates) {
    rate.value -= bias;
  }
  std::vector<Eigen::Vector3d> versors;
  for (const Interval& rest : rests) {
    const Eigen::Vector3d raw = mean(record.accelerometer, rest);
    versors.push_back(calibrated_accelerometer(accelerometer.data(), raw).normalized());
  }
  Fit fit{.parameters = gyroscope_start};
  ceres::Problem problem;
  for (std::size_t i = 0; i + 1 < rests.size(); ++i) {
    // A motion lasts from the last sample of a static interval to the sample before the next static
    // interval. imu_tk's results are reproduced only with these limits.
    const Interval motion{rests[i].last, rests[i + 1].first - 1};
    auto* cost = new ceres::AutoDiffCostFunction<MotionResidual, 3, 9>(
        new MotionResidual{versors[i], versors[i + 1], rates, motion});
    problem.AddResidualBlock(cost, nullptr, fit.parameters.data());
  }
  fit.cost = least_cost(&problem);
  return fit;
}

// ---- One calibration, timed ----

using Clock = std::chrono::steady_clock;

struct Milliseconds {
  double detection = 0.0;
  double accelerometer = 0.0;
  double gyroscope = 0.0;
  double calibrating = 0.0;  // total time of detection, accelerometer fit and gyroscope fit
};

struct Result {
  int multiplier = 0;
  Intervals rests;
  Fit accelerometer;
  Fit gyroscope;
  Milliseconds elapsed;
};

/// Returns the milliseconds since `start`, and sets `start` to now.
double lap(Clock::time_point& start) {
  const Clock::time_point now = Clock::now();
  return std::chrono::duration<double, std::milli>(now - std::exchange(start, now)).count();
}

Result calibrate(const Record& record) {
  Result best;
  Clock::time_point start = Clock::now();
  const Samples& samples = record.accelerometer;
  const double reference = variance(samples, initial_interval(samples)).norm();
  for (int k = first_multiplier; k <= last_multiplier; ++k) {
    Intervals rests = static_intervals(samples, k * reference);
    best.elapsed.detection += lap(start);
    const Fit fit = fit_accelerometer(samples, rests);
    if (k == first_multiplier || fit.cost < best.accelerometer.cost) {
      best.multiplier = k;
      best.rests = std::move(rests);
      best.accelerometer = fit;
    }
    best.elapsed.accelerometer += lap(start);
  }
  best.gyroscope = fit_gyroscope(record, best.rests, best.accelerometer.parameters);
  best.elapsed.gyroscope = lap(start);
  best.elapsed.calibrating =
      best.elapsed.detection + best.elapsed.accelerometer + best.elapsed.gyroscope;
  return best;
}

/// Prints the results next to the published results of imu_tk.
/// @return true if every result agrees to half a unit of the last published digit.
bool agrees_with_imu_tk(const Result& result) {
  bool equal = true;
  const auto compare = [&equal](const char* name, double value, double imu_tk, double last_digit) {
    const bool met = std::abs(value - imu_tk) <= 0.5 * last_digit;
    std::printf("%-21s %-15.9g imu_tk %-12.7g %s\n", name, value, imu_tk,
                met ? "equal" : "DIFFERS");
    equal = equal && met;
  };
  const Parameters& a = result.accelerometer.parameters;
  const Parameters& g = result.gyroscope.parameters;
  compare("accelerometer cost", result.accelerometer.cost, 0.120131, 1e-6);
  compare("accelerometer scale x", a[3], 2.41278e-3, 1e-8);
  compare("accelerometer scale y", a[4], 2.42712e-3, 1e-8);
  compare("accelerometer scale z", a[5], 2.41168e-3, 1e-8);
  compare("accelerometer bias x", a[6], 33124.18, 1e-2);
  compare("accelerometer bias y", a[7], 33275.18, 1e-2);
  compare("accelerometer bias z", a[8], 32364.42, 1e-2);
  compare("gyroscope cost", result.gyroscope.cost, 1.50696e-3, 1e-8);
  compare("gyroscope scale x", g[6], 2.09295e-4, 1e-9);
  compare("gyroscope scale y", g[7], 2.09899e-4, 1e-9);
  compare("gyroscope scale z", g[8], 2.09483e-4, 1e-9);
  return equal;
}

std::vector<double> sorted_times(const std::vector<Result>& rounds, double Milliseconds::*stage) {
  std::vector<double> times;
  for (const Result& round : rounds) {
    times.push_back(round.elapsed.*stage);
  }
  std::sort(times.begin(), times.end());
  return times;
}

double median(const std::vector<double>& sorted) {
  return (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]) / 2.0;
}

void print_report(const std::vector<Result>& rounds) {
  const Result& result = rounds.front();
  const std::size_t residuals = result.rests.size() * samples_per_interval;
  std::printf("%zu static intervals with k = %d, %zu residuals, rms %.4g m/s^2\n",
              result.rests.size(), result.multiplier, residuals,
              std::sqrt(2.0 * result.accelerometer.cost / static_cast<double>(residuals)));
  const bool equal = agrees_with_imu_tk(result);
  const std::vector<double> all = sorted_times(rounds, &Milliseconds::calibrating);
  const double detection = median(sorted_times(rounds, &Milliseconds::detection));
  const double accelerometer = median(sorted_times(rounds, &Milliseconds::accelerometer));
  const double gyroscope = median(sorted_times(rounds, &Milliseconds::gyroscope));
  std::printf(
      "median of %zu rounds [ms]: detection %.1f, accelerometer %.1f, gyroscope %.1f, all "
      "%.1f\n",
      rounds.size(), detection, accelerometer, gyroscope, median(all));
  std::printf(
      "{\"peer\":\"imu_tk stand-in\",\"calibrating_ms\":%.3f,\"min_ms\":%.3f,\"max_ms\":%.3f,"
      "\"static_detection_ms\":%.3f,\"accelerometer_ms\":%.3f,\"gyroscope_ms\":%.3f,"
      "\"rounds\":%zu,\"intervals\":%zu,\"k\":%d,\"accelerometer_cost\":%.9g,"
      "\"gyroscope_cost\":%.9g,\"equal_to_imu_tk\":%s}\n",
      median(all), all.front(), all.back(), detection, accelerometer, gyroscope, rounds.size(),
      result.rests.size(), result.multiplier, result.accelerometer.cost, result.gyroscope.cost,
      equal ? "true" : "false");
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 5;
  if (argc < 2 || rounds < 1) {
    std::fprintf(stderr, "usage: %s xsens_acc_gyro.csv [rounds]\n", argv[0]);
    return 2;
  }
  const Record record = read_record(argv[1]);
  std::vector<Result> results;
  for (int i = 0; i < rounds; ++i) {
    results.push_back(calibrate(record));
  }
  print_report(results);
}
