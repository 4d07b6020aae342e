// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/simulate.hpp"

#include <cmath>
#include <cstddef>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/field_kind.hpp"

namespace axiscal {

Calibration on_level_table(Calibration truth) {
  FieldDescription& field = truth.field;
  // What gravity, or else a turntable's axis, says of the table's slope.
  const Eigen::Vector3d* up = nullptr;
  if (field.parts.empty() && field.in_table && field_kind(field.kind).along_normal) {
    up = &*field.in_table;
  }
  for (const FieldPartDescription& part : field.parts) {
    up = field_kind(part.kind).vertical ? &part.in_table : up;
  }
  for (const AlsoResponse& also : truth.also) {
    up = field_kind(also.kind).vertical ? &also.in_table : up;
  }
  if (up == nullptr) {
    return truth;  // its slope is not known from the record
  }
  const Eigen::Vector3d direction = (up->z() < 0.0 ? -1.0 : 1.0) * up->normalized();
  constexpr double least_height = 0.1;  // a field in the table's plane tells no slope
  if (direction.z() < least_height) {
    return truth;
  }
  const Eigen::Matrix3d level_from_sloping =
      rotation_sloping_from_level({direction.x(), direction.y()}).transpose();
  if (field.in_table && field.parts.empty()) {
    field.in_table = level_from_sloping * *field.in_table;
  }
  for (FieldPartDescription& part : field.parts) {
    if (!part.set_by_level) {
      part.in_table = level_from_sloping * part.in_table;
    }
  }
  for (AlsoResponse& also : truth.also) {
    also.in_table = level_from_sloping * also.in_table;
  }
  return truth;
}

Calibration with_field_of_site(Calibration truth) {
  FieldDescription& field = truth.field;
  if (field.in_table || !field.site || !field.parts.empty()) {
    return truth;
  }
  Experiment experiment;
  experiment.field.kind = field.kind;
  experiment.field.unit = field.unit;
  experiment.field.magnitude = field.magnitude;
  experiment.field.site = field.site;
  experiment.field.date = field.date;
  experiment.field.model = field.model;
  experiment.fence_azimuth_rad = 0.0;
  field.in_table = make_field_description(experiment).in_table;
  return truth;
}

namespace {

// Streams of one seed: 0 shuffles run sheets, small numbers are the noise of the instruments. What
// all instruments of a run share comes from one stream, their own troubles from one for each.
constexpr std::uint32_t stream_of_cube = 1U << 20U;
constexpr std::uint32_t stream_of_world = 1U << 21U;

// What the world does to the readings of one instrument, one after another.
class Troubles {
 public:
  Troubles(const World& world,
           const Eigen::VectorXd& noise_sd,
           std::uint64_t seed,
           std::uint32_t stream,
           std::size_t readings)
      : world_(world),
        noise_sd_(noise_sd),
        cube_(seed, stream_of_cube),
        own_(seed, stream_of_world + stream),
        readings_(static_cast<double>(readings)),
        noise_(Eigen::VectorXd::Zero(noise_sd.size())),
        walk_(noise_),
        walked_(noise_),
        block_bias_(noise_) {}

  // Goes on to the next reading.
  void next(int block) {
    if (block != block_) {
      block_ = block;
      mount_ = rotation_by(world_.mount_rad * own_.normals<3>());
      for (double& bias : block_bias_) {
        bias = world_.block_sd * own_.normal();
      }
    }
    seat_ = rotation_by(world_.seat_rad * cube_.normals<3>());
    ++at_;
  }

  // How the field that the table holds is seen in the sensor, the cube lying as it now does.
  [[nodiscard]] Eigen::Matrix3d as_seated(const Eigen::Matrix3d& rotation_sensor_from_table) const {
    return mount_ * rotation_sensor_from_table * seat_;
  }

  // What is added to the response.
  // @param random  of the noise, which a white world takes its numbers from alone.
  [[nodiscard]] Eigen::VectorXd added(RandomStream& random) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(noise_.size());
    for (Eigen::Index k = 0; k < sum.size(); ++k) {
      if (noise_sd_(k) > 0.0) {
        const double fresh = random.normal() * spread();
        noise_(k) = at_ == 1
                        ? fresh
                        : world_.ar * noise_(k) + std::sqrt(1.0 - world_.ar * world_.ar) * fresh;
        sum(k) += noise_sd_(k) * noise_(k);
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

  [[nodiscard]] const Eigen::VectorXd& bias_of_run() const { return walked_; }

 private:
  // What a normal number is multiplied with to be Student's, of standard deviation 1.
  double spread() {
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

  const World& world_;
  const Eigen::VectorXd& noise_sd_;
  RandomStream cube_;
  RandomStream own_;
  double readings_;
  double at_ = 0.0;        // number of the reading, from 1
  int block_ = 0;          // blocks count from 1
  Eigen::VectorXd noise_;  // of the reading before, in its standard deviations
  Eigen::VectorXd walk_;
  Eigen::VectorXd walked_;  // its mean over the run, so far
  Eigen::VectorXd block_bias_;
  Eigen::Matrix3d mount_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d seat_ = Eigen::Matrix3d::Identity();
};

// What the squared and cubed field along each axis adds.
Eigen::VectorXd nonlinear_part(const World& world,
                               const Calibration& truth,
                               const Eigen::Vector3d& field) {
  const Eigen::Index m = truth.response.bias.size();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Vector3d S = truth.response.sensitivity.row(k);
    const double along = S.normalized().dot(field) / truth.field.magnitude;
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

void check_simulation(const Calibration& truth, const SimulationOptions& options) {
  const Eigen::Index m = truth.response.bias.size();
  if (truth.response.sensitivity.rows() != m) {
    throw DomainError("simulate: the truth needs a bias and a row of sensitivities for each axis");
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
    throw DomainError(formatted(
        "simulate: the noise, and k2 and k3 of the world, need one number, or one for each of the "
        "{} axes",
        m));
  }
}

}  // namespace

SimulatedRun simulate_run(const Calibration& truth,
                          const std::vector<RunSheetRow>& sheet,
                          const SimulationOptions& options) {
  check_simulation(truth, options);
  // Of a sum what is made on the table stays as it is when the table is tilted or turned. A field
  // alone is always turned: a lamp or coil that does not stand as the record says.
  const Eigen::Matrix3d turned = rotation_sloping_from_level(options.slope) *
                                 rotation_table_from_enu(options.fence_azimuth_rad);
  std::vector<Eigen::Vector3d> parts;
  for (const FieldPartDescription& part : truth.field.parts) {
    parts.emplace_back(part.set_by_level ? part.in_table : Eigen::Vector3d(turned * part.in_table));
  }
  const TableField sum = parts.empty() ? TableField() : TableField(truth.field.parts);
  const auto field_in_table = [&](double level) -> Eigen::Vector3d {
    return parts.empty() ? Eigen::Vector3d(turned * truth.field.at_level(level))
                         : sum.at(parts, level);
  };
  RandomStream random(options.seed, 1 + options.stream);
  const Eigen::VectorXd noise_sd = noise_of_axes(options, truth.response.bias.size());
  Troubles troubles(options.world, noise_sd, options.seed, options.stream, sheet.size());
  SimulatedRun run;
  Observations& observations = run.observations;
  observations.has_block = true;
  observations.response.resize(static_cast<Eigen::Index>(sheet.size()), truth.response.bias.size());
  observations.readings = readings_of(sheet);
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const RunSheetRow& row = sheet[i];
    std::optional<double>& temperature = observations.readings[i].temperature;
    if (temperature && options.temperature_sd > 0.0) {
      *temperature += options.temperature_sd * random.normal();
    }
    observations.has_level = observations.has_level || row.entry.level != 1.0;
    troubles.next(row.block);
    if (options.world.mount_rad > 0.0) {
      observations.readings[i].mount = row.block;
    }
    const Eigen::Matrix3d rotation_sensor_from_table = troubles.as_seated(
        options.rotation_sensor_from_positioner *
        options.positioner.rotation_table_from_positioner(row.entry.point).transpose());
    const Eigen::Vector3d field_in_sensor =
        rotation_sensor_from_table * field_in_table(row.entry.level);
    Eigen::VectorXd response = response_at(truth, field_in_sensor, temperature) +
                               nonlinear_part(options.world, truth, field_in_sensor);
    if (truth.instrument.one_sided) {
      // No light from behind: what is left is the dark reading.
      response = response.cwiseMax(truth.response.bias);
    }
    for (const AlsoResponse& also : truth.also) {
      response += also.sensitivity * (rotation_sensor_from_table * (turned * also.in_table));
    }
    response += troubles.added(random);
    for (const double step : {options.resolution, options.world.round}) {
      if (step > 0.0) {
        response = step * (response / step).array().round();
      }
    }
    observations.response.row(static_cast<Eigen::Index>(i)) = response;
  }
  if (!observations.response.allFinite()) {
    throw DomainError("simulate: noise or field are so large that readings overflow");
  }
  run.bias_of_run = troubles.bias_of_run();
  return run;
}

Observations simulate(const Calibration& truth,
                      const std::vector<RunSheetRow>& sheet,
                      const SimulationOptions& options) {
  return simulate_run(truth, sheet, options).observations;
}

}  // namespace axiscal
