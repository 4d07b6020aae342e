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

/// A simulated instrument in a cube, on a tilted table, in the hands of a simulated person: an
/// accelerometer, unless play() says what it is. Lengths of the field are in parts of F.
struct SimulationSetup {
  std::uint64_t seed = 1;
  double noise_sd = 1e-4;  ///< scatter of one sample [g]
  double rate_hz = 100.0;
  double speed = 0.0;                    ///< times real time; 0: as fast as can be
  Eigen::Vector2d slope{0.003, -0.002};  ///< slope of the table [rad]
  double error_rate = 0.0;               ///< how often the person lays the cube wrong
  double knock_rate = 0.0;               ///< how often the table is knocked during a rest
  double placement_sd_rad = 2e-5;        ///< repeatability of a seat
  double sensitivity = 1.0;              ///< about [unit per g]
  std::optional<double> temperature;     ///< gives a channel of that name
};

/// A mistake that the simulated person made.
struct SimulatedMistake {
  DesignPoint wanted;
  DesignPoint laid;
  bool was_warned = false;  ///< before the next point was asked for
};

/// The person lays the cube as asked, or wrong at the given rate; told so, lays it right. The time
/// of the samples is the simulation's.
class SimulatedSource final : public Source {
 public:
  SimulatedSource(std::string name, const SimulationSetup& setup);

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] bool is_live() const override { return setup_.speed > 0.0; }
  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override;
  void request(const DesignEntry* entry, bool warned) override;

  void roam(bool by_rests) override;

  /// Takes the experiment's axes, units and field, with the requested levels. If the direction of
  /// the field is unknown, the seed chooses one.
  /// @throws SetupError  for a field that moves, because a simulation lacks the time of day.
  void play(const Experiment& experiment) override;

  /// @return the true response of the instrument [unit per field unit]; for an accelerometer per g.
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
  RandomStream random_;  // draws the instrument and its seats
  RandomStream person_;  // errs alike, however many samples there were
  LinearResponse truth_;
  FieldDescription field_;    // in_table is always there
  double sensitivity_ = 1.0;  // about [unit per field unit]
  bool one_sided_ = false;
  std::vector<SimulatedMistake> mistakes_;

  double time_s_ = 0.0;
  double started_s_ = -1.0;  // when it began, by the clock on the wall
  std::optional<DesignEntry> wanted_;
  FieldLevel level_;
  TableField in_table_;  // the field as it is stated
  DesignPoint lies_{Face::minus_z, Face::plus_y};
  Eigen::Quaterniond from_ = Eigen::Quaterniond::Identity();  // table from positioner
  Eigen::Quaterniond to_ = Eigen::Quaterniond::Identity();
  double moves_from_s_ = -1.0;
  double moves_until_s_ = -1.0;
  double acts_at_s_ = -1.0;  // when the person does what was asked
  double knock_at_s_ = -1.0;
  bool lays_right_ = false;
  std::optional<bool> roams_by_rests_;  // nothing: it lies in its cube
};

}  // namespace axiscal
