// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/recording.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/plan/src/world_effects.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::uint32_t stream_of_hand = 1U << 22U;

void require_samples(const Recording& recording, std::size_t fewest) {
  if (recording.samples < fewest || !(recording.rate_hz > 0.0)) {
    throw DomainError(
        formatted("simulate: the recording needs {} samples or more, and a rate above 0", fewest));
  }
}

// Simulates the attitude of an instrument that is turned by hand in all directions. Each component
// of its angular rate is a sum of slow sine waves. The rate is about 2 rad/s.
class TurningHand {
 public:
  explicit TurningHand(std::uint64_t seed) {
    RandomStream random(seed, stream_of_hand);
    const Eigen::Vector4d any = random.normals<4>();
    attitude_ = Eigen::Quaterniond(any(0), any(1), any(2), any(3)).normalized();
    for (Wave& wave : waves_) {
      wave.amplitude = random.normals<3>();
      wave.hertz = 0.05 + 0.4 * random.uniform();
      wave.phase = 2.0 * std::numbers::pi * random.uniform();
    }
  }

  [[nodiscard]] Eigen::Matrix3d table_from_sensor() const { return attitude_.toRotationMatrix(); }

  void go_on(double seconds) {
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    for (const Wave& wave : waves_) {
      rate += wave.amplitude * std::sin(2.0 * std::numbers::pi * wave.hertz * time_s_ + wave.phase);
    }
    attitude_ = (attitude_ * Eigen::Quaterniond(rotation_by(rate * seconds))).normalized();
    time_s_ += seconds;
  }

 private:
  struct Wave {
    Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();
    double hertz = 0.0;
    double phase = 0.0;
  };
  std::array<Wave, 4> waves_;
  Eigen::Quaterniond attitude_ = Eigen::Quaterniond::Identity();
  double time_s_ = 0.0;
};

// Builds a table of simulated readings, one row for each sample.
class RecordedReadings {
 public:
  RecordedReadings(const SensorModel& truth,
                   const Recording& recording,
                   const SimulationOptions& options)
      : options_(options),
        noise_sd_(noise_of_axes(options, truth.response.bias.size())),
        troubles_(options.world, noise_sd_, options.seed, options.stream, recording.samples),
        random_(options.seed, 1 + options.stream) {
    readings_.resize(static_cast<Eigen::Index>(recording.samples), noise_sd_.size());
  }

  void put(Eigen::VectorXd response) {
    troubles_.next(1);
    response += troubles_.added(
        random_, [&]() -> Eigen::VectorXd { return Eigen::VectorXd::Zero(response.size()); });
    readings_.row(at_++) = rounded(std::move(response), options_);
  }

  void lay() { troubles_.lay(); }
  [[nodiscard]] const WorldEffects& troubles() const { return troubles_; }
  [[nodiscard]] Eigen::Index count() const { return at_; }
  [[nodiscard]] Eigen::MatrixXd take() { return readings_.topRows(at_); }

 private:
  const SimulationOptions& options_;
  Eigen::VectorXd noise_sd_;
  WorldEffects troubles_;
  RandomStream random_;
  Eigen::MatrixXd readings_;
  Eigen::Index at_ = 0;
};

// Returns the temperature of a sweep, which changes smoothly from the first value to the second and
// back.
// @param part  the elapsed fraction of the recording, 0 to 1.
double swept_temperature(const Recording& recording, double part) {
  const auto [low, high] = recording.temperatures;
  return low + (high - low) * 0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * part));
}

}  // namespace

std::optional<RecordingKind> parse_recording(std::string_view name) {
  if (name == "free") {
    return RecordingKind::free;
  }
  if (name == "sweep") {
    return RecordingKind::sweep;
  }
  return name == "turns" ? std::optional(RecordingKind::turns) : std::nullopt;
}

HandMotion hand_motion(const Eigen::Matrix3d& from,
                       const Eigen::Matrix3d& to,
                       double part,
                       double seconds) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(from.transpose() * to));
  const double angle = 2.0 * std::numbers::pi * part;
  const double done = part - std::sin(angle) / (2.0 * std::numbers::pi);
  return {.table_from_sensor =
              from * Eigen::AngleAxisd(done * turn.angle(), turn.axis()).toRotationMatrix(),
          .rate = (1.0 - std::cos(angle)) / seconds * turn.angle() * turn.axis()};
}

SimulatedRun simulate_recording(const SensorModel& truth,
                                const Recording& recording,
                                const SimulationOptions& options) {
  constexpr std::size_t fewest = 100;
  require_samples(recording, fewest);
  check_simulation(truth, options);
  RecordedReadings readings(truth, recording, options);
  TurningHand hand(options.seed);
  const bool swept = recording.kind == RecordingKind::sweep;
  const Eigen::Vector3d field =
      truth.field.in_table.value_or(truth.field.magnitude * Eigen::Vector3d::UnitZ());
  const double interval = 1.0 / recording.rate_hz;
  SimulatedRun run;
  for (std::size_t i = 0; i < recording.samples; ++i) {
    Reading& reading = run.observations.readings.emplace_back();
    reading.run = static_cast<int>(i) + 1;
    reading.time_s = static_cast<double>(i) * interval;
    Eigen::Vector3d in_sensor = options.rotation_sensor_from_positioner * field;
    if (swept) {
      const double part = static_cast<double>(i) / static_cast<double>(recording.samples - 1);
      reading.temperature = swept_temperature(recording, part);
    } else {
      in_sensor = hand.table_from_sensor().transpose() * field;
      hand.go_on(interval);
    }
    readings.put(response_at(truth, in_sensor, reading.temperature) +
                 nonlinear_part(options.world, truth, in_sensor));
  }
  run.observations.response = readings.take();
  run.bias_of_run = readings.troubles().bias_of_run();
  return run;
}

SimulatedTurns simulate_turns(const SensorModel& truth,
                              const std::vector<RunSheetRow>& sheet,
                              const Recording& recording,
                              const Eigen::Vector3d& earth_in_table,
                              const SimulationOptions& options) {
  constexpr std::size_t fewest_a_seat = 30;
  require_samples(recording, fewest_a_seat * sheet.size());
  check_simulation(truth, options);
  if (truth.response.bias.size() != 3) {
    throw DomainError("simulate: a recording of turns needs a gyroscope of three axes");
  }
  const std::size_t turning = recording.samples / sheet.size() / 3;
  const std::size_t resting = recording.samples / sheet.size() - turning;
  const double turn_s = static_cast<double>(turning) / recording.rate_hz;
  RecordedReadings readings(truth, recording, options);
  const Eigen::Vector3d up_in_table =
      rotation_sloping_from_level(options.slope) * Eigen::Vector3d::UnitZ();
  std::vector<Eigen::Matrix3d> seats;  // rotations from sensor to table
  for (const RunSheetRow& row : sheet) {
    readings.lay();
    seats.emplace_back(
        readings.troubles()
            .as_seated(
                options.rotation_sensor_from_positioner *
                options.positioner.rotation_table_from_positioner(row.entry.point).transpose())
            .transpose());
  }
  SimulatedTurns turns;
  turns.up.resize(static_cast<Eigen::Index>(recording.samples), 3);
  const auto put = [&](const HandMotion& motion) {
    const Eigen::Matrix3d sensor_from_table = motion.table_from_sensor.transpose();
    turns.time_s.push_back(static_cast<double>(turns.time_s.size()) / recording.rate_hz);
    turns.up.row(readings.count()) = (sensor_from_table * up_in_table).transpose();
    readings.put(truth.response.at(motion.rate + sensor_from_table * earth_in_table));
  };
  for (std::size_t s = 0; s < seats.size(); ++s) {
    turns.rests.emplace_back(turns.time_s.size(), resting);
    for (std::size_t i = 0; i < resting; ++i) {
      put({.table_from_sensor = seats[s]});
    }
    for (std::size_t i = 1; s + 1 < seats.size() && i < turning; ++i) {
      put(hand_motion(seats[s], seats[s + 1], static_cast<double>(i) / static_cast<double>(turning),
                      turn_s));
    }
  }
  turns.readings = readings.take();
  turns.up.conservativeResize(turns.readings.rows(), 3);
  turns.bias_of_run = readings.troubles().bias_of_run();
  return turns;
}

Calibration calibrate_turns(const SimulatedTurns& recording,
                            const std::vector<RunSheetRow>& sheet,
                            const Instrument& instrument,
                            const Positioner& cube,
                            const Eigen::Matrix3d& rotation_sensor_from_positioner,
                            const std::optional<Site>& site) {
  const auto count = static_cast<Eigen::Index>(recording.rests.size());
  Eigen::MatrixX3d means(count, 3);
  Eigen::MatrixX3d mean_u(count, 3);
  Eigen::MatrixX3d ups(count, 3);
  for (Eigen::Index r = 0; r < count; ++r) {
    const auto [first, length] = recording.rests[static_cast<std::size_t>(r)];
    const auto samples = recording.readings.middleRows(static_cast<Eigen::Index>(first),
                                                       static_cast<Eigen::Index>(length));
    const auto n = static_cast<double>(length);
    means.row(r) = samples.colwise().mean();
    mean_u.row(r) =
        ((samples.rowwise() - means.row(r)).colwise().squaredNorm() / (n * (n - 1.0))).cwiseSqrt();
    ups.row(r) = recording.up.row(static_cast<Eigen::Index>(first));
  }
  std::vector<GyroscopeTurn> turns;
  for (std::size_t r = 0; r + 1 < recording.rests.size(); ++r) {
    const std::size_t first = recording.rests[r].first + recording.rests[r].second - 1;
    const std::size_t length = recording.rests[r + 1].first - first + 1;
    GyroscopeTurn& turn = turns.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      turn.readings[axis] =
          std::span(recording.readings.col(static_cast<Eigen::Index>(axis)).data() + first, length);
    }
    turn.time_s = std::span(recording.time_s).subspan(first, length);
    turn.up_before = ups.row(static_cast<Eigen::Index>(r)).transpose();
    turn.up_after = ups.row(static_cast<Eigen::Index>(r) + 1).transpose();
    turn.follows = r > 0;
    set_turn_between_seats(cube, rotation_sensor_from_positioner, sheet[r].entry.point,
                           sheet[r + 1].entry.point, turn);
  }
  const RestFit rests = fit_rests(means, ups, mean_u);
  TurnFitOptions options;
  set_earth_rotation(site, turns, options);
  return turn_calibration(fit_turns(turns, rests, options), instrument, rests.sd);
}

SensorModel rotated_to_shape(SensorModel truth, MagnitudeShape shape) {
  const Eigen::Matrix3d S = truth.response.sensitivity;
  if (shape == MagnitudeShape::symmetric) {
    truth.response.sensitivity = S * nearest_rotation(S).transpose();
  } else {
    // A lower triangle with its rows and columns in reverse order is an upper triangle.
    const Eigen::Matrix3d reversed = (S * S.transpose()).reverse();
    const Eigen::Matrix3d lower = Whitening(reversed).root();
    truth.response.sensitivity = lower.reverse();
  }
  return truth;
}

}  // namespace axiscal
