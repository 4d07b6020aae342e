// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/mount_turns.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/fit/fit.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_mounts = 40;

}  // namespace

std::optional<MountTurns> fitted_mounts(const ReadingSet& set,
                                        const Estimate& estimate,
                                        bool known_field) {
  const bool one_mount = std::all_of(
      set.readings.begin(), set.readings.end(),
      [&](const Reading& reading) { return reading.mount == set.readings.front().mount; });
  if (one_mount || !estimate.field.has_vectors() || set.rotation_sensor_from_table.empty() ||
      set.axis_count() < 2) {
    return std::nullopt;
  }
  const Model model = Model(set, known_field).with_free_mounts();
  const Place start = model.start(estimate.field);
  if (start.mounts.size() > most_mounts) {
    return std::nullopt;
  }
  const Eigen::VectorXd& sigma = estimate.statistics.residual_sd;
  const auto found = model.solved(model.at(start), sigma);
  const Fit fit(set, found.state, sigma);
  if (!found.converged || !fit.is_determined()) {
    return std::nullopt;
  }
  const Eigen::Index turns = fit.shared() - found.state->direction_count();
  return MountTurns{.turns = found.state->place.mounts,
                    .expected = fit.covariance_of_shared().diagonal().tail(turns).mean()};
}

}  // namespace axiscal
