// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "calib/calibrate/src/prepared_run.hpp"
#include "calib/fit/estimation.hpp"
#include "calib/fit/reading_source.hpp"
#include "calib/fit/solved_readings.hpp"
#include "calib/mistakes/culprit.hpp"

namespace axiscal {

/// The unknowns that are fitted to a run, and the trials that led to this choice.
struct ChosenModel {
  ModelChoice choice;
  /// Trials of temperature orders; empty if the order was not chosen by trials.
  std::vector<TemperatureOrderTrial> trials;
  bool temperature_has_no_effect = false;  ///< true if no temperature term was significant
};

/// Chooses the order of the temperature terms and the effects of the run (shifts between blocks, a
/// stated drift).
/// @throws RefusedError  if the readings do not determine a fit.
[[nodiscard]] ChosenModel choose_model(const PreparedRun& run);

/// A run after its fit.
struct FittedRun {
  ReadingSource source;                   ///< the observations, and the model that is fitted
  std::unique_ptr<const ReadingSet> set;  ///< the readings as input of the fitted model
  Estimate estimate;
  AxisMask seen;  ///< the readings that each axis uses; empty if every axis uses all readings
  /// The mean square that the fitted rotations of the mounts would have if they were only noise;
  /// see MountTurns::expected.
  double mounts_expected = 0.0;
  std::shared_ptr<const Solution> solution;  ///< the solution for `set`; null if not kept

  [[nodiscard]] SolvedReadings readings(const MethodKind& method) const {
    return {*set, method.directions_known, solution};
  }
};

/// Solves the model by the run's method. If the readings do not determine the effects of the run,
/// the model is solved without them.
/// @throws RefusedError, RankDeficientError
[[nodiscard]] FittedRun solve(const PreparedRun& run, const ChosenModel& model);

/// The result of the search for mistakes, and the readings without their shared errors. A shared
/// error affects several readings.
struct SearchedRun {
  bool searched = false;
  MistakeSearch mistakes;
  /// The fitted readings with their shared errors removed; null if there are no shared errors.
  std::unique_ptr<const ReadingSet> judged;
  ReadingSet kept_out;  ///< the confirmation readings, with their shared errors removed too

  /// Warnings about mistakes for which the fit has a term: a drift, a step of the biases, or a
  /// memory (hysteresis).
  std::vector<CalibrationWarning> taken_in;
};

[[nodiscard]] SearchedRun find_mistakes(const PreparedRun& run, const FittedRun& fit);

/// If the likeliest mistake is a drift, a step of the biases, or a memory, adds a term for it to
/// the model. A memory (hysteresis) means that each reading lags behind the change since the
/// previous reading.
/// @return the extended model. It is nullopt if the mistake is of another kind, if the model
///         already has this term, or if FitOptions::drift is not automatic.
[[nodiscard]] std::optional<ChosenModel> with_mistake_term(const PreparedRun& run,
                                                           ChosenModel model,
                                                           const SearchedRun& search);

/// @param fit  a fit with a term for the mistake that the search found.
/// @return `search.taken_in`. If the new term is a step or a memory, a warning for it is added.
[[nodiscard]] std::vector<CalibrationWarning> warnings_of_terms(const PreparedRun& run,
                                                                const FittedRun& fit,
                                                                const SearchedRun& search);

/// @return the fit. If it has a term for a drift that the search found, a note is added.
[[nodiscard]] FittedRun with_note_of_drift(const PreparedRun& run, FittedRun fit);

}  // namespace axiscal
