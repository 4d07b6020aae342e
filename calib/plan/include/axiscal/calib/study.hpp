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

/// The settings of a study: repeated simulations and calibrations of an instrument (method.md,
/// section 8).
struct StudySetup {
  SensorModel truth;      ///< true instrument, field (as field.in_table) and response
  Experiment experiment;  ///< settings of each calibration, with the cube that it assumes
  std::vector<DesignEntry> design;
  int replicates = 1;
  std::vector<double> temperatures;  ///< soak temperatures; if empty, the readings have none
  SimulationOptions simulation;      ///< noise, slope, other errors, ...; its seed is not used
  /// Standard deviation of each axis's noise [unit]; empty: simulation.noise_sd.
  Eigen::VectorXd noise_sd;
  double slope_sd = 0.0;  ///< standard deviation of each run's additional slope, x and y [rad]
  /// If a drawing is stated, each run has a random cube, made from the drawing with `tolerances`.
  /// The calibration assumes the cube of the drawing.
  std::optional<CubeFeet> drawing;
  Surface surface;
  Tolerances tolerances;
  /// If true, each run's face normals are those of experiment.positioner plus random errors with
  /// the covariance of its normals.
  bool random_normals = false;
  /// If stated, each run is a recording: `free`, for method magnitude, or `turns` of a gyroscope
  /// between the design points. The Earth's rotation is that at the experiment's site. If the site
  /// is not stated, the direction of the Earth's axis is random.
  std::optional<Recording> recording;
  /// If true, only the regression is studied: the field of every reading is known exactly, only
  /// noise is simulated, and the results are biases and sensitivities. This is ten thousand times
  /// faster.
  bool regression_only = false;
  /// If true, the results include the field components and angles of one reading of each run, in a
  /// random attitude (|pitch| below 80 degrees).
  bool angles = true;
  /// If true, every run is searched for mistakes, as calibrate() does, and warnings are counted.
  bool alarms = false;
};

/// The part of a study's trials that one call runs. All shards of one seed together run the same
/// trials as one call without shards.
struct Shard {
  int number = 1;  ///< number of this shard, from 1
  int count = 1;
};

/// Sums of one quantity over the trials of one block.
struct StudySums {
  double trials = 0.0;
  double error = 0.0;
  double error_squared = 0.0;
  double u_squared = 0.0;
  double covered = 0.0;
};

/// The result of some trials. The trials are divided into blocks, and the sums of the blocks are
/// added in a fixed order. Therefore the result does not depend on the division into shards.
struct Study {
  std::uint64_t seed = 1;
  std::int64_t trials = 0;  ///< number of trials in the whole study, in all shards
  std::int64_t block = 0;   ///< number of trials in a block
  /// A digest of the study's settings. All shards of one study have the same digest.
  std::string setup;
  std::vector<std::string> parameters;
  std::vector<std::int64_t> blocks;          ///< zero-based indices of the blocks that were run
  std::vector<std::vector<StudySums>> sums;  ///< for each block, the sums of each parameter
  std::int64_t refused = 0;                  ///< number of trials without a calibration
  /// For the name of each warning, the number of trials that had this warning. The name `any`
  /// counts the trials with at least one warning. Empty if StudySetup::alarms was false.
  std::map<std::string, std::int64_t> warnings;
};

/// The statistics of one quantity over all trials.
struct StudyResult {
  std::string parameter;
  double mean_error = 0.0;   ///< bias of the estimate
  double sd = 0.0;           ///< standard deviation of the errors
  double stated_u = 0.0;     ///< root mean square of the stated standard uncertainties
  double coverage_95 = 0.0;  ///< fraction of the stated 95 % intervals that contain the truth
};

/// Runs the trials of a shard on all cores. Trial t depends only on the seed and on t, so neither
/// shards nor cores change the result. If errors other than white noise are simulated, each run is
/// searched for mistakes, because calibrate() fits a drift that this search finds.
///
/// @param progress  receives the number of finished trials; may be empty. Its calls never overlap.
/// @throws DomainError  for fewer than 1 trial, for an invalid shard, for a recording `sweep`
///         (because its biases contain the field), or if `regression_only` is combined with
///         settings that it does not support (errors other than white noise, alarms, temperature
///         terms, additional fields, one-sided axes).
/// @throws SetupError, RefusedError  as in calibrate(), if the first trial cannot be calibrated.
[[nodiscard]] Study run_study(const StudySetup& setup,
                              std::int64_t trials,
                              std::uint64_t seed,
                              const Shard& shard = {},
                              const std::function<void(std::int64_t)>& progress = {});

/// @return the number of blocks of the whole study.
[[nodiscard]] AXISCAL_EXPORT std::int64_t block_count(const Study& study);

/// Merges the shards of a study.
/// @throws DomainError  if the shards are of different studies, or if two contain the same block.
[[nodiscard]] AXISCAL_EXPORT Study merge(const std::vector<Study>& shards);

[[nodiscard]] AXISCAL_EXPORT std::vector<StudyResult> results_of(const Study& study);

/// @return the study as JSON.
/// @param with_blocks  true to include the sums of the blocks, which merge() needs.
[[nodiscard]] AXISCAL_EXPORT std::string study_json(const Study& study, bool with_blocks);

/// @throws DataError  if the text is not a study with the sums of its blocks.
[[nodiscard]] AXISCAL_EXPORT Study parse_study(std::string_view text, const std::string& path);

}  // namespace axiscal
