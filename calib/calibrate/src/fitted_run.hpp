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

/// The unknowns that are fitted to a run, and why.
struct ChosenModel {
  ModelChoice choice;
  std::vector<TemperatureOrderTrial>
      trials;                              ///< for the temperature order, if the readings chose it
  bool temperature_has_no_effect = false;  ///< trials found no need of temperature terms
};

/// Chooses the temperature order, and the effects of the run: shifts of blocks, a stated drift.
/// @throws RefusedError  if the readings determine no fit at all.
[[nodiscard]] ChosenModel choose_model(const PreparedRun& run);

/// A run after its fit.
struct FittedRun {
  ReadingSource source;                   ///< under the model that was fitted
  std::unique_ptr<const ReadingSet> set;  ///< the readings in the terms of that model
  Estimate estimate;
  AxisMask seen;                             ///< the readings that one-sided axes see; empty: all
  double mounts_expected = 0.0;              ///< as MountTurns::expected
  std::shared_ptr<const Solution> solution;  ///< of the set, if it is at hand

  [[nodiscard]] SolvedReadings readings(const MethodKind& method) const {
    return {*set, method.directions_known, solution};
  }
};

/// Solves the model by the run's method. Effects of the run that the readings do not determine are
/// left out.
/// @throws RefusedError, RankDeficientError
[[nodiscard]] FittedRun solve(const PreparedRun& run, const ChosenModel& model);

/// The search for mistakes, and the readings without errors that they share.
struct SearchedRun {
  bool searched = false;
  MistakeSearch mistakes;
  std::unique_ptr<const ReadingSet> judged;  ///< null: the readings share no errors
  ReadingSet
      kept_out;  ///< the readings to be confirmed, reduced in the same way as the fitted ones

  std::vector<CalibrationWarning> taken_in;  ///< of mistakes that the fit has terms for
};

[[nodiscard]] SearchedRun find_mistakes(const PreparedRun& run, const FittedRun& fit);

/// @return the model with a term for the mistake that explains the readings best: a drift, a step
/// of
///         the biases, or a memory. nullopt if it is another mistake, if the model has the term, or
///         if terms of the course of the run are switched off.
[[nodiscard]] std::optional<ChosenModel> with_mistake_term(const PreparedRun& run,
                                                           ChosenModel model,
                                                           const SearchedRun& search);

/// @param fit  with a term for the mistake that the search found.
/// @return the warnings of the terms so far, and that of the new term.
[[nodiscard]] std::vector<CalibrationWarning> warnings_of_terms(const PreparedRun& run,
                                                                const FittedRun& fit,
                                                                const SearchedRun& search);

/// @return the fit with a note of a drift that was found.
[[nodiscard]] FittedRun with_note_of_drift(const PreparedRun& run, FittedRun fit);

}  // namespace axiscal
