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

/// Chooses the temperature order, and the effects of the run: shifts of blocks, a stated drift.
/// @throws RefusedError  if the readings do not determine a fit.
[[nodiscard]] ChosenModel choose_model(const PreparedRun& run);

/// A run after its fit.
struct FittedRun {
  ReadingSource source;                   ///< the observations, and the model that is fitted
  std::unique_ptr<const ReadingSet> set;  ///< the readings in the terms of the fitted model
  Estimate estimate;
  AxisMask seen;                             ///< the readings that one-sided axes see; empty: all
  double mounts_expected = 0.0;              ///< MountTurns::expected of the last fit of mounts
  std::shared_ptr<const Solution> solution;  ///< the solution for `set`; null if not kept

  [[nodiscard]] SolvedReadings readings(const MethodKind& method) const {
    return {*set, method.directions_known, solution};
  }
};

/// Solves the model by the run's method. Effects of the run that the readings do not determine are
/// left out.
/// @throws RefusedError, RankDeficientError
[[nodiscard]] FittedRun solve(const PreparedRun& run, const ChosenModel& model);

/// The result of the search for mistakes, and the readings without their shared errors.
struct SearchedRun {
  bool searched = false;
  MistakeSearch mistakes;
  std::unique_ptr<const ReadingSet> judged;  ///< without shared errors; null if they share none
  ReadingSet kept_out;  ///< the confirmation readings, reduced in the same way as the fitted ones

  std::vector<CalibrationWarning> taken_in;  ///< warnings of mistakes with a term in the fit
};

[[nodiscard]] SearchedRun find_mistakes(const PreparedRun& run, const FittedRun& fit);

/// @return the model with a term for the likeliest mistake, if this is a drift, a step of the
///         biases or a memory. nullopt for another mistake, if the model already has the term, or
///         if FitOptions::drift is not automatic.
[[nodiscard]] std::optional<ChosenModel> with_mistake_term(const PreparedRun& run,
                                                           ChosenModel model,
                                                           const SearchedRun& search);

/// @param fit  a fit with a term for the mistake that the search found.
/// @return the warnings of the search for earlier terms, and the warning for the new term.
[[nodiscard]] std::vector<CalibrationWarning> warnings_of_terms(const PreparedRun& run,
                                                                const FittedRun& fit,
                                                                const SearchedRun& search);

/// @return the fit, with a note if it has a term for a drift that was found.
[[nodiscard]] FittedRun with_note_of_drift(const PreparedRun& run, FittedRun fit);

}  // namespace axiscal
