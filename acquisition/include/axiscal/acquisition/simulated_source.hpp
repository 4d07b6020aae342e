// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "axiscal/acquisition/source.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/field/table_field.hpp"
#include "axiscal/instruments/instrument.hpp"

namespace axiscal {

/// The properties of a simulated instrument, which a simulated person places in a cube on a tilted
/// table. It is an accelerometer unless play() sets another instrument. If play() sets another
/// field, the unit "g" below stands for the magnitude of that field.
struct SimulationSetup {
  std::uint64_t seed = 1;
  double noise_sd = 1e-4;  ///< scatter of one sample [g]
  double rate_hz = 100.0;
  double speed = 0.0;                    ///< speed relative to real time; 0: as fast as possible
  Eigen::Vector2d slope{0.003, -0.002};  ///< slope of the table [rad]
  double error_rate = 0.0;               ///< probability that the person places the cube wrong
  double knock_rate = 0.0;               ///< probability of a knock after the cube was placed
  double placement_sd_rad = 2e-5;        ///< repeatability of the cube's orientation
  double sensitivity = 1.0;              ///< approximate sensitivity [unit per g]
  /// Value of an additional channel `temperature` [degC]; nullopt: no such channel.
  std::optional<double> temperature;
};

/// A mistake that the simulated person made.
struct SimulatedMistake {
  DesignPoint wanted;
  DesignPoint laid;
  bool was_warned = false;  ///< true if the session warned before it asked for the next point
};

/// A source with a simulated instrument. The simulated person places the cube as requested, except
/// for mistakes with the probability error_rate. After a warning, the person corrects the mistake.
/// Sample times are simulated times.
class SimulatedSource final : public Source {
 public:
  SimulatedSource(std::string name, const SimulationSetup& setup);

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] bool is_live() const override { return setup_.speed > 0.0; }
  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override;
  void request(const DesignEntry* entry, bool warned) override;

  void set_free_motion(bool by_rests) override;

  /// Simulates the axes, units and field of an experiment, at the requested field levels. If the
  /// direction of the field is unknown, a random direction is drawn; it depends on the seed.
  /// @throws SetupError  if the field's direction changes with time, because a simulation lacks the
  ///                     time of day.
  void play(const Experiment& experiment) override;

  /// @return the true response of the instrument [unit per field unit]; the field unit of an
  ///         accelerometer is g.
  [[nodiscard]] const LinearResponse& truth() const { return truth_; }
  [[nodiscard]] const std::vector<SimulatedMistake>& mistakes() const { return mistakes_; }

 private:
  void sample(SampleBatch& batch);
  void start_moving(const DesignPoint& point);
  void turn_freely();
  void draw_instrument(double sensitivity, const SensitivityMatrix& nominal);

  std::string name_;
  SimulationSetup setup_;
  std::vector<Channel> channels_;
  // Random numbers for the instrument, the placement of the cube and the noise.
  RandomStream random_;
  // Random numbers for the person's mistakes; independent of the number of samples.
  RandomStream person_;
  LinearResponse truth_;
  FieldDescription field_;    // the field; its member in_table always has a value
  double sensitivity_ = 1.0;  // approximate sensitivity [unit per field unit]
  bool one_sided_ = false;
  std::vector<SimulatedMistake> mistakes_;

  double time_s_ = 0.0;
  double started_s_ = -1.0;  // session_seconds() at the first read(); negative before it
  std::optional<DesignEntry> wanted_;
  FieldLevel level_;
  TableField in_table_;  // the field in the table's frame
  DesignPoint lies_{Face::minus_z, Face::plus_y};
  Eigen::Quaterniond from_ = Eigen::Quaterniond::Identity();  // rotation_table_from_positioner
  Eigen::Quaterniond to_ = Eigen::Quaterniond::Identity();
  double moves_from_s_ = -1.0;
  double moves_until_s_ = -1.0;
  double acts_at_s_ = -1.0;  // time at which the person follows the request; negative: no request
  double knock_at_s_ = -1.0;
  bool lays_right_ = false;
  // Argument of set_free_motion(); nullopt if the instrument is in a cube.
  std::optional<bool> roams_by_rests_;
};

}  // namespace axiscal
