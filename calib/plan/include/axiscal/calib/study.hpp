// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/recording.hpp"
#include "axiscal/calib/simulate.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The subject of repeated simulations and calibrations (method.md, section 8).
struct StudySetup {
  SensorModel truth;      ///< instrument, field, response; its `in_table` is the field there
  Experiment experiment;  ///< the settings of each calibration; its positioner is the assumed one
  std::vector<DesignEntry> design;
  int replicates = 1;
  std::vector<double> temperatures;  ///< soak levels; none: no temperatures
  SimulationOptions simulation;      ///< noise, slope, the world, ...; its seed does not count
  Eigen::VectorXd noise_sd;          ///< one for each axis [unit]; empty: simulation.noise_sd
  double slope_sd = 0.0;  ///< each run's table is tilted by this much more, x and y [rad]
  /// Each run has a cube of its own, made with these errors; the calibration believes the drawing.
  std::optional<CubeFeet> drawing;
  Surface surface;
  Tolerances tolerances;
  /// Each run's face normals are those of experiment.positioner and errors of its covariance.
  bool random_normals = false;
  /// Each run is a recording: `free`, by method magnitude, or `turns`, of a gyroscope in the seats
  /// of the design. The Earth turns as at the experiment's site, or about any axis.
  std::optional<Recording> recording;
  /// The regression alone: the field of every reading is known exactly, only noise is simulated,
  /// and biases and sensitivities are looked at. Ten thousand times as fast.
  bool regression_only = false;
  /// Also components and angles that one reading gives, in a random attitude for each run (|pitch|
  /// below 80 degrees).
  bool angles = true;
  /// Mistakes are looked for in every run, as for a user, and warnings are counted.
  bool alarms = false;
};

/// Which part of a study this run does: shards of one seed are together the same trials as one run.
struct Shard {
  int number = 1;  ///< from 1
  int count = 1;
};

/// Sums over the trials of one block, for one quantity.
struct StudySums {
  double trials = 0.0;
  double error = 0.0;
  double error_squared = 0.0;
  double u_squared = 0.0;
  double covered = 0.0;
};

/// The result of some trials. Trials are summed by blocks in the order of the blocks, so the result
/// does not depend on the division into shards.
struct Study {
  std::uint64_t seed = 1;
  std::int64_t trials = 0;  ///< number of trials of the whole study
  std::int64_t block = 0;   ///< trials in a block
  std::string
      setup;  ///< a digest of the simulation's settings; shards of one study have equal digests
  std::vector<std::string> parameters;
  std::vector<std::int64_t> blocks;          ///< numbers of those that were done
  std::vector<std::vector<StudySums>> sums;  ///< for each block, one for each parameter
  std::int64_t refused = 0;                  ///< trials that gave no calibration
  /// The number of trials with a warning, by its name, and `any` for at least one; empty if
  /// warnings were off.
  std::map<std::string, std::int64_t> warnings;
};

/// How one quantity came out.
struct StudyResult {
  std::string parameter;
  double mean_error = 0.0;   ///< bias of the estimate
  double sd = 0.0;           ///< the scatter of its errors
  double stated_u = 0.0;     ///< root mean square of the stated standard uncertainties
  double coverage_95 = 0.0;  ///< share of the stated 95 % intervals that held the truth
};

/// Runs the trials of a shard, on all cores. Trial t depends on the seed and t alone, so that
/// neither shards nor cores change the result. In a world that is not white mistakes are looked for
/// as well, as a drift that is found is fitted.
///
/// @param progress  told how many trials are done; may be empty; never called twice at once.
/// @throws DomainError  for fewer than 1 trial, for an invalid shard, or if `regression_only` is
///         combined with settings that it does not support (worlds, alarms, temperature terms,
///         second fields, one-sided axes); also for a recording `sweep`, because its biases contain
///         the field's part.
/// @throws SetupError, RefusedError  as in calibrate(), if the first trial cannot be calibrated.
[[nodiscard]] Study run_study(const StudySetup& setup,
                              std::int64_t trials,
                              std::uint64_t seed,
                              const Shard& shard = {},
                              const std::function<void(std::int64_t)>& progress = {});

/// @return the number of blocks of the whole study.
[[nodiscard]] AXISCAL_EXPORT std::int64_t block_count(const Study& study);

/// Puts shards together.
/// @throws DomainError  if they are of different studies, or a block is there twice.
[[nodiscard]] AXISCAL_EXPORT Study merge(const std::vector<Study>& shards);

[[nodiscard]] AXISCAL_EXPORT std::vector<StudyResult> results_of(const Study& study);

/// @return the study as JSON.
/// @param with_blocks  whether its sums are in it, for merge().
[[nodiscard]] AXISCAL_EXPORT std::string study_json(const Study& study, bool with_blocks);

/// @throws DataError  for a text that is not a study with its sums.
[[nodiscard]] AXISCAL_EXPORT Study parse_study(std::string_view text, const std::string& path);

}  // namespace axiscal
