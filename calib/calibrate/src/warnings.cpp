// SPDX-License-Identifier: Apache-2.0
#include "warnings.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "axiscal/calib/calibration_warning.hpp"
#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "outliers.hpp"

namespace axiscal {
namespace {

// Probability of a false alarm over a whole run. Studentised residuals of `joint` have heavier
// tails than t where readings are few: at 1e-4 outliers are announced in 0.1 to 0.2 % of good runs.
constexpr double false_lack_of_fit = 1e-3;
constexpr double false_moved_table = 1e-3;
// Residual scatter above this part of the full response is no calibration but a mistake.
constexpr double largest_residual_share = 0.02;
constexpr double largest_good_condition = 30.0;
// Above this standard error the direction of the field is unknown, and with it S.
constexpr double largest_direction_se_rad = 0.05;
constexpr double false_slope = 0.005;
constexpr double false_nonlinearity = 0.005;

std::string rounded(double value, int digits) {
  return number_text(value, digits);
}

class Finder {
 public:
  Finder(const Calibration& calibration,
         const Estimate& estimate,
         std::vector<int> unpaired_runs,
         bool searched,
         const std::optional<Culprit>& culprit)
      : calibration_(calibration),
        estimate_(estimate),
        unpaired_runs_(std::move(unpaired_runs)),
        searched_(searched),
        culprit_(culprit) {}

  std::vector<CalibrationWarning> find() {
    find_uncertain_direction();
    find_two_solutions();
    find_unsettled();
    find_gap();
    find_unseen_axes();
    // What the culprit search explains needs no second word.
    if (culprit_) {
      warnings_.insert(warnings_.end(), culprit_->warnings.begin(), culprit_->warnings.end());
    } else {
      if (!searched_) {
        find_inconsistent_levelness();
        if (std::optional<CalibrationWarning> outliers = warning_of_outliers(calibration_)) {
          warnings_.push_back(std::move(*outliers));
        }
      }
      find_uncertain_sensitivity();
      find_poor_fit();
    }
    find_moved_table();
    find_axes();
    // A curved response looks like a limited axis; repeats tell that it is not chance.
    if (!culprit_ || culprit_->correction.code == WarningCode::saturated) {
      find_lack_of_fit();
    }
    find_nonlinearity();
    find_slope();
    find_unpaired();
    find_other_magnitude();
    find_condition();
    find_no_redundancy();
    find_saturated();
    return std::move(warnings_);
  }

 private:
  void add(WarningCode code, std::vector<int> runs, std::string message) {
    warnings_.push_back({.code = code, .runs = std::move(runs), .message = std::move(message)});
  }

  [[nodiscard]] const std::string& axis_name(Eigen::Index k) const {
    return calibration_.sensor.instrument.axes[static_cast<std::size_t>(k)];
  }

  [[nodiscard]] const FitStatistics& statistics() const { return *calibration_.fit.statistics; }

  // @return true if the readings determine the sensitivity of an axis to its nominal component.
  [[nodiscard]] bool sees_own(Eigen::Index k) const {
    const std::optional<int> nominal = nominal_axis(calibration_.sensor.instrument, k);
    return estimate_.seen.cols() == 0 || !nominal || estimate_.seen.row(*nominal).norm() > 0.5;
  }

  // Axes of which a partial design shows cross-axis terms alone.
  void find_unseen_axes() {
    std::vector<std::string> names;
    for (Eigen::Index k = 0; k < calibration_.sensor.response.bias.size(); ++k) {
      if (!sees_own(k)) {
        names.push_back(axis_name(k));
      }
    }
    if (!names.empty()) {
      add(WarningCode::coverage, {},
          formatted(
              "the fields of the readings have no part along {} {}, so its sensitivity is not "
              "determined; add readings that are turned about another axis",
              names.size() == 1 ? "axis" : "the axes", joined(names)));
    }
  }

  [[nodiscard]] double full_response(Eigen::Index k) const {
    return calibration_.sensor.response.sensitivity.row(k).norm() *
           calibration_.sensor.field.magnitude;
  }

  void find_uncertain_direction() {
    if (estimate_.direction_se_rad > largest_direction_se_rad) {
      add(WarningCode::uncertain_direction, {},
          formatted("the readings hardly determine the field's direction in the table (standard "
                    "error {} rad), so the sensitivities are as uncertain; take each face turned "
                    "round as well, or use method known if the table is level",
                    rounded(estimate_.direction_se_rad, 2)));
    }
  }

  // Sensitivities that may as well be of another axis.
  void find_uncertain_sensitivity() {
    constexpr double largest_share = 0.1;
    for (Eigen::Index k = 0; k < calibration_.sensor.response.bias.size() && !by_magnitude(); ++k) {
      const double share = statistics().sensitivity_se.row(k).norm() /
                           calibration_.sensor.response.sensitivity.row(k).norm();
      if (share > largest_share && estimate_.direction_se_rad > 0.0) {
        add(WarningCode::uncertain_sensitivity, {},
            formatted("axis {}: its sensitivity is known only to {} % by these readings; too many "
                      "of them are left out or of one kind: add readings, or use method known if "
                      "the table is level",
                      axis_name(k), rounded(100.0 * share, 2)));
      }
    }
  }

  void find_two_solutions() {
    if (!estimate_.ambiguity.empty()) {
      add(WarningCode::two_solutions, {},
          estimate_.ambiguity +
              "; say roughly where it points (its vector in the table, or the fence's azimuth), or "
              "name "
              "the axes by what they sense (x, y, z)");
    }
  }

  void find_unsettled() {
    if (estimate_.unsettled) {
      add(WarningCode::one_sided_unsettled, {},
          "which readings some one-sided axis sees does not settle: a reading lies at the edge of "
          "its view; move the lamp a little, or leave that reading out");
    }
  }

  void find_gap() {
    const auto& quality = calibration_.fit.orientations;
    if (quality && quality->largest_gap_rad > largest_good_gap_rad) {
      add(WarningCode::coverage, {},
          formatted("the orientations leave a gap: towards {} of the sensor the nearest reading is "
                    "{} degrees away; add orientations in which that side meets the field",
                    direction_in_words(quality->gap),
                    rounded(quality->largest_gap_rad * deg_per_rad, 2)));
    }
  }

  // The readings of a rest face in a block.
  [[nodiscard]] std::vector<int> runs_of_face(const LevelnessEstimate& estimate) const {
    std::vector<int> runs;
    for (const ReadingResidual& residual : calibration_.fit.residuals) {
      if (residual.used && residual.point && residual.point->rest() == estimate.point.rest() &&
          residual.block.value_or(estimate.block) == estimate.block) {
        runs.push_back(residual.run);
      }
    }
    return runs;
  }

  void find_inconsistent_levelness() {
    const std::optional<Levelness>& levelness = calibration_.fit.levelness;
    if (!levelness || !levelness->suspect) {
      return;
    }
    const std::vector<int> runs = runs_of_face(*levelness->suspect);
    add(WarningCode::levelness, runs,
        formatted("{}: the table's slope by rest face {} disagrees with the other faces (p = {}); "
                  "look for grit under a foot, a wrong face, a fence not touched or a moved table, "
                  "and take these readings again",
                  name_of_runs(runs), face_name(levelness->suspect->point.rest()),
                  rounded(levelness->p_value, 2)));
  }

  // The readings that robust regression gives no weight for an axis.
  [[nodiscard]] std::set<int> runs_without_weight(Eigen::Index k) const {
    std::set<int> runs;
    for (Eigen::Index i = 0; i < statistics().robust_weight.rows(); ++i) {
      if (statistics().robust_weight(i, k) == 0.0) {
        const std::vector<int>& own = statistics().rows[static_cast<std::size_t>(i)].runs;
        runs.insert(own.begin(), own.end());
      }
    }
    return runs;
  }

  // By `paired` a mistake can hide in the averages, so the readings' own residuals count too.
  void find_poor_fit() {
    if (by_magnitude()) {
      find_poor_magnitude();
      return;
    }
    for (Eigen::Index k = 0; k < calibration_.sensor.response.bias.size(); ++k) {
      const std::set<int> rejected = runs_without_weight(k);
      const auto counts = [&](const ReadingResidual& residual) {
        return residual.used && !std::isnan(residual.response(k)) &&
               !rejected.contains(residual.run);
      };
      double squares = 0.0;
      double largest = 0.0;
      std::size_t count = 0;
      for (const ReadingResidual& residual : calibration_.fit.residuals) {
        if (counts(residual)) {
          squares += residual.response(k) * residual.response(k);
          largest = std::max(largest, std::abs(residual.response(k)));
          ++count;
        }
      }
      if (count < 2 * rejected.size()) {
        add(WarningCode::no_fit, {rejected.begin(), rejected.end()},
            formatted("axis {}: robust regression gives no weight to {} of {} readings; so many "
                      "wrong ones cannot be told from right ones: look for wrong labels or units",
                      axis_name(k), rejected.size(), count + rejected.size()));
        continue;
      }
      if (!sees_own(k)) {
        continue;  // a full response is not known
      }
      const double rms = std::sqrt(squares / static_cast<double>(count));
      const double share = std::fmax(statistics().residual_sd(k), rms) / full_response(k);
      if (!(share > largest_residual_share)) {
        continue;
      }
      std::vector<int> runs;
      for (const ReadingResidual& residual : calibration_.fit.residuals) {
        if (counts(residual) && std::abs(residual.response(k)) > 0.5 * largest) {
          runs.push_back(residual.run);
        }
      }
      // Nothing of such a fit can be trusted.
      constexpr double hopeless = 0.2;
      add(share > hopeless ? WarningCode::no_fit : WarningCode::poor_fit, runs,
          formatted("axis {}: the residuals are {} % of the full response, the largest at {}; a "
                    "reading may be at the wrong design point, or two exchanged, or the noise is "
                    "large: correct the labels or take these readings again{}",
                    axis_name(k), rounded(100.0 * share, 2), name_of_runs(runs), other_reasons()));
    }
  }

  // A field that can be set, and no column that says to what it was.
  [[nodiscard]] bool lacks_level() const {
    const std::vector<FieldDescription>& parts = calibration_.sensor.field.parts;
    const FieldKind& kind = field_kind(calibration_.sensor.field.kind);
    const bool can_be_set =
        parts.empty() ? !kind.name.empty() && !kind.local
                      : std::any_of(parts.begin(), parts.end(),
                                    [](const FieldDescription& part) { return part.set_by_level; });
    return can_be_set && calibration_.sensor.field.in_table &&
           !calibration_.fit.residuals.empty() && !calibration_.fit.residuals.front().level;
  }

  // What else leaves large residuals, by the kind of field and instrument.
  [[nodiscard]] std::string other_reasons() const {
    const InstrumentKind& kind = find_instrument_kind(calibration_.sensor.instrument.kind);
    std::string reasons;
    if (lacks_level()) {
      reasons += "; is the column 'level' missing (the multiple of the field that was set)?";
    }
    if (kind.sees_one_side && !calibration_.sensor.instrument.one_sided) {
      reasons += "; photodiodes that see no light from behind are one-sided: state that";
    }
    if (kind.answers_to_gravity && calibration_.sensor.also.empty()) {
      reasons += "; if the instrument answers to gravity, state gravity as a second field (also)";
    }
    return reasons;
  }

  // Without labels a reading has one residual: of the field's magnitude.
  void find_poor_magnitude() {
    double error = calibration_.fit.orientations ? calibration_.fit.orientations->fit_error : 0.0;
    if (calibration_.fit.robust) {  // readings that got no weight do not count
      error = statistics().residual_sd.maxCoeff() / full_response(0);
    }
    // Beyond that the readings are not of one field at rest.
    constexpr double hopeless = 0.1;
    if (error > hopeless) {
      add(WarningCode::no_fit, {},
          formatted(
              "the magnitude differs from the field's by {} % (rms), so no sensitivity can "
              "be trusted: the instrument was moving while it was read, or the field here "
              "is not the model's but changes from place to place (indoors?); take the "
              "readings again at rest{}",
              rounded(100.0 * error, 2),
              calibration_.fit.robust ? "" : ", or use robust weights if only some are wrong"));
    } else if (error > largest_residual_share) {
      add(WarningCode::poor_fit, {},
          formatted("the magnitude differs from the field's by {} % (rms): the instrument was "
                    "moved while it was read, iron nearby disturbs the field, or the noise is "
                    "large; {}take the readings again at rest",
                    rounded(100.0 * error, 2),
                    calibration_.fit.robust ? "" : "try robust weights, or "));
    }
  }

  [[nodiscard]] bool by_magnitude() const {
    return method_kind(calibration_.fit.method).by_magnitude;
  }

  void find_axes() {
    if (calibration_.sensor.instrument.one_sided || calibration_.sensor.response.bias.size() > 3) {
      return;  // such axes point where they like, one each way
    }
    for (Eigen::Index k = 0; k < calibration_.sensor.response.bias.size(); ++k) {
      const std::optional<int> nominal = nominal_axis(calibration_.sensor.instrument, k);
      if (!nominal || !sees_own(k)) {
        continue;
      }
      const Eigen::Vector3d row = calibration_.sensor.response.sensitivity.row(k);
      Eigen::Index main = 0;
      row.cwiseAbs().maxCoeff(&main);
      const std::string letter(1, "xyz"[main]);
      if (main != *nominal) {
        add(WarningCode::axis_swapped, {},
            formatted("axis {} reads mostly along {}{}; are columns exchanged, or is the "
                      "instrument turned in the cube?",
                      axis_name(k), row(main) < 0.0 ? "-" : "+", letter));
      } else if (row(main) < 0.0) {
        add(WarningCode::axis_reversed, {},
            formatted("axis {} reads reversed: its sensitivity to {} is negative; is its sign or "
                      "wiring exchanged, or are all faces labelled by the opposite one?",
                      axis_name(k), letter));
      }
    }
  }

  void find_lack_of_fit() {
    const std::vector<LackOfFit>& tests = statistics().lack_of_fit;
    for (std::size_t k = 0; k < tests.size(); ++k) {
      // NaN, where nothing can be tested, is no warning.
      if (tests[k].p_value * static_cast<double>(tests.size()) < false_lack_of_fit) {
        add(WarningCode::lack_of_fit, {},
            formatted("axis {}: the readings are further from the model than their repeats allow "
                      "({}); the cube's faces, its seating or the axis's linearity limit this run, "
                      "and the standard errors include it",
                      axis_name(static_cast<Eigen::Index>(k)),
                      std::isfinite(tests[k].f)
                          ? formatted("F = {}, p = {}", rounded(tests[k].f, 3),
                                      rounded(tests[k].p_value, 2))
                          : std::string("which agree to the last digit")));
        return;
      }
    }
  }

  void find_nonlinearity() {
    const std::optional<CurvatureTest>& curvature = estimate_.curvature;
    // A response that bends looks like an axis that is limited; which of both it is nobody can
    // tell.
    const bool explained = culprit_ && culprit_->correction.code != WarningCode::saturated;
    // Where readings scatter more along the field, the ends of the response scatter as well.
    const std::vector<ScatterComponent>& components = calibration_.fit.statistics->components;
    const bool is_noisy_at_ends =
        std::any_of(components.begin(), components.end(),
                    [](const ScatterComponent& one) { return one.name.starts_with("field_"); });
    const double level = false_nonlinearity * (is_noisy_at_ends ? 0.01 : 1.0);
    if (explained || !curvature || !(curvature->p_value < level)) {
      return;
    }
    Eigen::Index most = 0;
    curvature->bends.cwiseAbs().maxCoeff(&most);
    const double bend = curvature->bends(most);
    const std::string found = formatted(
        "the response is not straight (p = {}): the square of the field adds {} {} to "
        "axis {} at full field",
        rounded(curvature->p_value, 2), rounded(bend, 2), calibration_.sensor.instrument.unit,
        axis_name(most));
    add(WarningCode::nonlinearity, {},
        by_magnitude()
            ? formatted(
                  "{}, which the biases hold in part; fit squared terms beside them (squares)",
                  found)
            : formatted("{}, and its bias holds a third of that; the instrument bends, or opposite "
                        "faces of the cube are not parallel: state the cube's face normals, or "
                        "keep in mind that calibrated readings are off by so much",
                        found));
  }

  // What is known of a stated direction, x and y in the table [parts of the magnitude].
  [[nodiscard]] double stated_slope_u() const {
    double variance = 0.0;
    if (calibration_.fit.uncertainty) {
      for (const UncertaintySource& source : calibration_.fit.uncertainty->sources) {
        if (source.name == "levelness" || source.name == "field direction") {
          variance += source.input_u * source.input_u;
        }
      }
    }
    return std::sqrt(variance);
  }

  // F(2, nu) with the stated uncertainty beside that of the differences.
  void find_slope() {
    const std::optional<Levelness>& levelness = calibration_.fit.levelness;
    if (!method_kind(calibration_.fit.method).directions_known || !levelness ||
        !calibration_.sensor.field.in_table) {
      return;
    }
    const Eigen::Vector3d given =
        *calibration_.sensor.field.in_table / calibration_.sensor.field.magnitude;
    const Eigen::Array2d off(levelness->mean_x - given.x(), levelness->mean_y - given.y());
    const Eigen::Array2d own =
        Eigen::Array2d(levelness->standard_error_x, levelness->standard_error_y).square();
    const Eigen::Array2d all = own + stated_slope_u() * stated_slope_u();
    const double share = (own / all).mean();
    constexpr double rounding = 1e-9;
    const double p = f_upper_p(0.5 * (off.square() / all).sum(), 2.0,
                               levelness->degrees_of_freedom / (share * share));
    // NaN, without degrees of freedom, is no warning.
    if (off.abs().maxCoeff() > rounding && p < false_slope) {
      add(WarningCode::slope, {},
          formatted(
              "the field was given as {}, {} in the table's plane (parts of its magnitude), but "
              "opposite readings show {}, {}; use method paired or joint, or correct the slope",
              rounded(given.x(), 4), rounded(given.y(), 4), rounded(levelness->mean_x, 4),
              rounded(levelness->mean_y, 4)));
    }
  }

  void find_moved_table() {
    const std::optional<Levelness>& levelness = calibration_.fit.levelness;
    if (levelness && levelness->block_p_value < false_moved_table) {
      add(WarningCode::table_moved, {},
          formatted("the table's slope differs between blocks (p = {}), so it was moved, and one "
                    "slope for all blocks is wrong; give each block its own (level by block)",
                    rounded(levelness->block_p_value, 2)));
    }
  }

  void find_unpaired() {
    if (!unpaired_runs_.empty()) {
      add(WarningCode::unpaired, unpaired_runs_,
          name_of_runs(unpaired_runs_) +
              ": left out, as `paired` needs the opposite reading (same rest face, block and "
              "level; opposite fence face); take it, or use method joint");
    }
  }

  void find_condition() {
    if (statistics().condition_number > largest_good_condition) {
      add(WarningCode::ill_conditioned, {},
          formatted("the design hardly tells some coefficients apart (condition number {}; a "
                    "standard design has less than 5), so standard errors are inflated; {}",
                    rounded(statistics().condition_number, 3),
                    calibration_.sensor.instrument.one_sided
                        ? "take all 24 points, or move the lamp away from the cube's diagonal"
                    : method_kind(calibration_.fit.method).by_magnitude
                        ? "add orientations all around"
                        : "take each face turned round as well"));
    }
  }

  void find_other_magnitude() {
    if (!method_kind(calibration_.fit.method).directions_known ||
        calibration_.sensor.field.in_table) {
      return;
    }
    constexpr double largest_deviation = 0.05;
    if (estimate_.field_varies) {
      return;
    }
    const double ratio = estimate_.mean_field / calibration_.sensor.field.magnitude;
    if (!(std::abs(ratio - 1.0) <= largest_deviation)) {
      add(WarningCode::field_magnitude, {},
          formatted("the columns fx, fy, fz have a length of {} on average, but the field is {} "
                    "{}; correct the unit, or give the magnitude",
                    rounded(estimate_.mean_field, 4),
                    rounded(calibration_.sensor.field.magnitude, 4),
                    calibration_.sensor.field.unit));
    }
  }

  // Readings that lie at one value where the others ask for more.
  void find_saturated() {
    for (const SaturatedAxis& axis : estimate_.saturated) {
      add(WarningCode::saturated, axis.runs,
          formatted("{}: axis {} reads {} and nothing beyond, short of what the other readings "
                    "predict: it is saturated, or its response bends towards that end; state its "
                    "range, or set the instrument to one that holds the field",
                    name_of_runs(axis.runs), axis_name(axis.axis), rounded(axis.value, 8)));
    }
  }

  void find_no_redundancy() {
    if (!(statistics().degrees_of_freedom.minCoeff() > 0.0)) {
      add(WarningCode::no_redundancy, {},
          "there are just as many readings as coefficients: no residual, so no uncertainty and no "
          "check; take more design points");
    }
  }

  const Calibration& calibration_;
  const Estimate& estimate_;
  std::vector<int> unpaired_runs_;
  bool searched_;
  const std::optional<Culprit>& culprit_;
  std::vector<CalibrationWarning> warnings_;
};

}  // namespace

std::vector<CalibrationWarning> find_warnings(const Calibration& calibration,
                                              const Estimate& estimate,
                                              std::vector<int> unpaired_runs,
                                              bool searched,
                                              const std::optional<Culprit>& culprit) {
  return Finder(calibration, estimate, std::move(unpaired_runs), searched, culprit).find();
}

}  // namespace axiscal
