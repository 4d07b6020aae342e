// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/src/world_effects.hpp"

#include <cmath>
#include <numbers>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Numbers of the random streams of one seed. Stream 0 shuffles run sheets. The next streams draw
// the noise, one for each instrument. stream_of_cube draws the errors that all instruments of a run
// share. The streams from stream_of_world on draw the other errors, one for each instrument.
constexpr std::uint32_t stream_of_cube = 1U << 20U;
constexpr std::uint32_t stream_of_world = 1U << 21U;

}  // namespace

WorldEffects::WorldEffects(const World& world,
                           const Eigen::VectorXd& noise_sd,
                           std::uint64_t seed,
                           std::uint32_t stream,
                           std::size_t readings)
    : world_(world),
      has_any_(!world.is_white()),
      noise_sd_(noise_sd),
      cube_(seed, stream_of_cube),
      own_(seed, stream_of_world + stream),
      readings_(static_cast<double>(readings)),
      noise_(Eigen::VectorXd::Zero(noise_sd.size())),
      walk_(noise_),
      walked_(noise_),
      block_bias_(noise_),
      gains_(Eigen::VectorXd::Ones(noise_sd.size())) {}

void WorldEffects::next(int block) {
  ++at_;
  if (!has_any_) {
    return;  // white noise alone needs no further random numbers
  }
  if (block != block_) {
    block_ = block;
    mount_ = rotation_by(std::hypot(world_.mount_rad, world_.remount_rad) * own_.normals<3>());
    for (double& bias : block_bias_) {
      bias = world_.block_sd * own_.normal();
    }
    for (Eigen::Index k = 0; k < gains_.size() && world_.gain > 0.0; ++k) {
      gains_(k) = 1.0 + world_.gain * own_.normal();
    }
  }
  if (world_.jitter > 0.0 || world_.wander > 0.0) {
    constexpr double kept = 0.9;
    const double fresh = own_.normal();
    wander_ = at_ == 1.0 ? fresh : kept * wander_ + std::sqrt(1.0 - kept * kept) * fresh;
    size_ = 1.0 + world_.jitter * own_.normal() + world_.wander * wander_;
  }
}

void WorldEffects::lay() {
  if (!has_any_) {
    return;
  }
  seat_ = rotation_by(world_.seat_rad * cube_.normals<3>());
}

Eigen::VectorXd WorldEffects::added(RandomStream& random,
                                    const std::function<Eigen::VectorXd()>& along) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(noise_.size());
  const bool more_at_ends = world_.ends > 0.0;
  const Eigen::VectorXd parts = more_at_ends ? along() : Eigen::VectorXd();
  for (Eigen::Index k = 0; k < sum.size(); ++k) {
    if (noise_sd_(k) > 0.0) {
      const double fresh = random.normal() * spread();
      noise_(k) =
          at_ == 1 ? fresh : world_.ar * noise_(k) + std::sqrt(1.0 - world_.ar * world_.ar) * fresh;
      const double more = world_.ends * world_.ends - 1.0;
      const double at_ends =
          more_at_ends ? std::sqrt(std::max(1.0 + more * parts(k) * parts(k), 0.0)) : 1.0;
      sum(k) += noise_sd_(k) * noise_(k) * at_ends;
    }
    if (world_.periodic > 0.0) {
      constexpr double period = 7.3;
      sum(k) += world_.periodic *
                std::sin(2.0 * std::numbers::pi * (at_ / period + static_cast<double>(k) / 3.0));
    }
    if (world_.ar_white > 0.0) {
      sum(k) += world_.ar_white * own_.normal();
    }
    if (world_.walk_sd > 0.0) {
      walk_(k) += world_.walk_sd * own_.normal();
      walked_(k) += walk_(k) / readings_;
      sum(k) += walk_(k);
    }
    sum(k) += block_bias_(k);
    if (readings_ > 1.0) {
      sum(k) += world_.drift * ((at_ - 1.0) / (readings_ - 1.0) - 0.5);
    }
  }
  return sum;
}

double WorldEffects::spread() {
  if (world_.tails == 0) {
    return 1.0;
  }
  double squares = 0.0;
  for (int i = 0; i < world_.tails; ++i) {
    const double one = own_.normal();
    squares += one * one;
  }
  return std::sqrt((world_.tails - 2.0) / squares);
}

Eigen::VectorXd parts_along(const SensorModel& truth, const Eigen::Vector3d& field) {
  return truth.response.sensitivity.rowwise().normalized() * field / truth.field.magnitude;
}

Eigen::VectorXd nonlinear_part(const World& world,
                               const SensorModel& truth,
                               const Eigen::Vector3d& field) {
  const Eigen::Index m = truth.response.bias.size();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(m);
  if (world.k2.empty() && world.k3.empty()) {
    return sum;
  }
  const Eigen::VectorXd all_along = parts_along(truth, field);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double along = all_along(k);
    const auto of_axis = [&](const std::vector<double>& terms) {
      return terms.empty() ? 0.0 : terms[terms.size() == 1 ? 0 : static_cast<std::size_t>(k)];
    };
    sum(k) = of_axis(world.k2) * along * along + of_axis(world.k3) * along * along * along;
  }
  return sum;
}

Eigen::VectorXd noise_of_axes(const SimulationOptions& options, Eigen::Index m) {
  return options.noise_sds.size() > 0 ? options.noise_sds
                                      : Eigen::VectorXd::Constant(m, options.noise_sd);
}

Eigen::VectorXd rounded(Eigen::VectorXd response, const SimulationOptions& options) {
  for (const double step : {options.resolution, options.world.round}) {
    if (step > 0.0) {
      response = (step * (response / step).array().round()).matrix().eval();
    }
  }
  return response;
}

void check_simulation(const SensorModel& truth, const SimulationOptions& options) {
  const Eigen::Index m = truth.response.bias.size();
  if (truth.response.sensitivity.rows() != m) {
    throw DomainError(
        "simulate: the true model needs a bias and a row of sensitivities for each axis");
  }
  const Eigen::VectorXd noise = noise_of_axes(options, m);
  if (!(noise.array() >= 0.0).all() || !noise.allFinite() || !(options.temperature_sd >= 0.0) ||
      !(options.resolution >= 0.0)) {
    throw DomainError("simulate: noise and resolution must not be negative");
  }
  const auto fits = [&](const std::vector<double>& values) {
    return values.size() <= 1 || static_cast<Eigen::Index>(values.size()) == m;
  };
  if (noise.size() != m || !fits(options.world.k2) || !fits(options.world.k3)) {
    throw DomainError(
        formatted("simulate: the noise, and 'k2' and 'k3' of the world, must each be one number, "
                  "or one number for each of the {} axes",
                  m));
  }
}

}  // namespace axiscal
