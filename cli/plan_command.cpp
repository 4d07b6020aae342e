// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

#include <fmt/format.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/design_quality.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/forecast.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "axiscal/report/run_sheet_page.hpp"
#include "commands.hpp"
#include "input.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

// Attitudes that the forecast is printed for.
constexpr std::array<double, 4> pitches_deg = {0.0, 45.0, 80.0, 85.0};

double not_negative(std::string_view option, const std::string& text) {
  const double value = number_of(option, text);
  if (value < 0.0) {
    throw UsageError(std::string(option) + ": must not be negative");
  }
  return value;
}

int positive_integer(std::string_view option, const std::string& text) {
  const int value = parse_integer(text).value_or(0);
  if (value < 1) {
    throw UsageError(std::string(option) + ": '" + text + "' is not a whole number from 1 on");
  }
  return value;
}

// What is planned: the experiment's file, or an accelerometer in gravity.
Experiment planned_experiment(const PlanCommand& command) {
  Experiment experiment;
  if (command.experiment) {
    experiment = read_experiment(*command.experiment);
  }
  if (experiment.instrument.kind.empty()) {
    experiment.instrument.kind = "accelerometer";
  }
  if (experiment.field.kind.empty()) {
    experiment.field.kind = "gravity";
  }
  if (command.positioner) {
    experiment.positioner = read_positioner(*command.positioner);
  }
  if (command.slope) {
    const std::vector<double> slope = numbers_of("--slope", *command.slope, 2);
    experiment.slope = Eigen::Vector2d(slope[0], slope[1]);
    if (!(experiment.slope.norm() < 1.0)) {
      throw UsageError("--slope: X^2 + Y^2 must be less than 1");
    }
  }
  if (command.method) {
    experiment.method = parse_method(*command.method);
    if (!experiment.method) {
      throw UsageError("--method: '" + *command.method +
                       "' is not known to this version; it knows paired, joint, known");
    }
  }
  return experiment;
}

// The method that calibrate would choose for these points.
Method planned_method(const Experiment& experiment, const std::vector<DesignEntry>& design) {
  Observations observations;
  for (const DesignEntry& entry : design) {
    observations.readings.push_back({.point = entry.point, .level = entry.level});
  }
  const Method method = choose_method(experiment, observations);
  // Fewer than ten points leave the field's direction open: a table known to be level is meant.
  return !experiment.method && method == Method::joint && design.size() < 10 ? Method::known
                                                                             : method;
}

ForecastSetup forecast_setup(const PlanCommand& command,
                             const Experiment& experiment,
                             const std::vector<DesignEntry>& design) {
  ForecastSetup setup;
  setup.design = design;
  setup.replicates = replicates_of(command.sheet);
  setup.nominal.instrument = experiment.instrument;
  Experiment level = experiment;
  level.slope.setZero();
  setup.nominal.field = make_field_description(level);
  const double sensitivity =
      command.sensitivity ? number_of("--sensitivity", *command.sensitivity) : 1.0;
  if (!(std::abs(sensitivity) > 0.0)) {
    throw UsageError("--sensitivity: must not be 0");
  }
  const Eigen::Index m = experiment.instrument.axis_count();
  setup.nominal.response.bias = Eigen::VectorXd::Zero(m);
  setup.nominal.response.sensitivity = SensitivityMatrix::Zero(m, 3);
  for (Eigen::Index k = 0; k < m; ++k) {
    setup.nominal.response.sensitivity(
        k, nominal_axis(experiment.instrument, k).value_or(static_cast<int>(k % 3))) = sensitivity;
  }
  setup.method = planned_method(experiment, design);
  setup.positioner = experiment.positioner;
  setup.slope = experiment.slope;
  setup.noise_sd = command.noise ? not_negative("--noise", *command.noise) : 0.0;
  setup.samples = command.samples ? positive_integer("--samples", *command.samples) : 1;
  setup.normal_u_rad =
      command.positioner_u ? not_negative("--positioner-u", *command.positioner_u) : 0.0;
  setup.level_u_rad = command.level_u ? not_negative("--level-u", *command.level_u) : 0.0;
  return setup;
}

Tolerances tolerances_of(const std::string& text) {
  Tolerances tolerances;
  for (const std::string_view item : split(text, ',')) {
    const std::size_t parting = item.find('=');
    const std::string name(item.substr(0, parting));
    double* value = name == "foot_height_m"    ? &tolerances.foot_height_m
                    : name == "ball_radius_m"  ? &tolerances.ball_radius_m
                    : name == "squareness_rad" ? &tolerances.squareness_rad
                    : name == "fence_rad"      ? &tolerances.fence_rad
                                               : nullptr;
    if (value == nullptr || parting == std::string_view::npos) {
      throw UsageError("--tolerances: '" + std::string(item) +
                       "' must be one of foot_height_m, ball_radius_m, squareness_rad, fence_rad, "
                       "=, and its standard deviation");
    }
    *value = not_negative("--tolerances", std::string(item.substr(parting + 1)));
  }
  return tolerances;
}

ToleranceStudy tolerance_study(const PlanCommand& command,
                               const ForecastSetup& setup,
                               const Positioner& positioner) {
  ToleranceStudy study;
  study.nominal = setup.nominal;
  study.design = setup.design;
  study.drawing = feet_of_frame({});
  study.surface = positioner.surface();
  study.tolerances = tolerances_of(*command.tolerances);
  study.slope = setup.slope;
  study.seed = seed_of(command.sheet);
  if (command.trials) {
    study.trials = positive_integer("--trials", *command.trials);
  }
  for (const Face face : all_faces) {
    if (positioner.feet(face)) {
      study.drawing[static_cast<std::size_t>(face)] = *positioner.feet(face);
    }
  }
  return study;
}

// All that is said of a plan.
struct Plan {
  ForecastSetup setup;
  DesignQuality quality;
  std::optional<OptimalDesign> optimal;
  std::optional<Forecast> forecast;
  std::optional<double> wanted_rad;
  int replicates_needed = 0;
  std::vector<ToleranceEffect> tolerances;
  std::vector<std::string> remarks;
};

double degrees(double radian) {
  return radian * deg_per_rad;
}

std::string short_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-";
}

class PlanText {
 public:
  explicit PlanText(const Plan& plan) : plan_(plan) {}

  std::string text() {
    add_design();
    if (plan_.forecast) {
      add_coefficients();
      add_angles();
    } else {
      text_ += "\nNo forecast: give the noise of a sample by --noise.\n";
    }
    add_wanted();
    add_tolerances();
    for (const std::string& remark : plan_.remarks) {
      text_ += "\n" + wrapped(remark, 80) + "\n";
    }
    return text_;
  }

 private:
  void add_design() {
    const ForecastSetup& setup = plan_.setup;
    const DesignQuality& quality = plan_.quality;
    text_ += fmt::format("{} design points, {} replicate{}: {} readings, method {}\n",
                         setup.design.size(), setup.replicates, setup.replicates == 1 ? "" : "s",
                         setup.design.size() * static_cast<std::size_t>(setup.replicates),
                         method_name(setup.method));
    if (!quality.determined) {
      text_ += "The design does not determine all coefficients.\n";
      return;
    }
    text_ += fmt::format("efficiency against the best {} readings: D {:.3f}, A {:.3f}, G {:.3f}\n",
                         setup.design.size(), quality.d_efficiency, quality.a_efficiency,
                         quality.g_efficiency);
    text_ +=
        fmt::format("variance inflation {:.3f}, {:.3f}, {:.3f}\n", quality.variance_inflation.x(),
                    quality.variance_inflation.y(), quality.variance_inflation.z());
    text_ += wrapped(
        fmt::format("largest prediction variance {:.4g} of a reading's, with the field along "
                    "({:.2f}, {:.2f}, {:.2f})",
                    quality.largest_prediction_variance / setup.replicates,
                    quality.worst_direction.x(), quality.worst_direction.y(),
                    quality.worst_direction.z()),
        80);
    text_ += "\n";
    if (plan_.optimal) {
      text_ += wrapped(
          fmt::format("the {} of the 24 points that determine most, for {}: D-efficiency {:.4f}; "
                      "the 12-point design has {:.4f}",
                      plan_.optimal->design.size(),
                      plan_.optimal->parameters == 10 ? "every direction of the field"
                                                      : "a field along the normal",
                      plan_.optimal->d_efficiency, plan_.optimal->d_efficiency_of_standard),
          80);
      text_ += "\n";
    }
  }

  void add_coefficients() {
    const Forecast& forecast = *plan_.forecast;
    const Instrument& instrument = plan_.setup.nominal.instrument;
    const Eigen::VectorXd u = forecast.covariance().diagonal().cwiseSqrt();
    text_ += fmt::format(
        "\nForecast: standard uncertainty (root mean square error) of bias [{0}] and "
        "of\nsensitivity to x, y, z [{0} per {1}]\n  "
        "{2:<12}{3:>12}{4:>12}{5:>12}{6:>12}{7:>8}\n",
        instrument.unit, plan_.setup.nominal.field.unit, "axis", "bias", "x", "y", "z", "dof");
    for (Eigen::Index k = 0; k < forecast.response.bias.size(); ++k) {
      text_ += fmt::format("  {:<12}", instrument.axes[static_cast<std::size_t>(k)].substr(0, 11));
      for (Eigen::Index j = 0; j < 4; ++j) {
        text_ += fmt::format("{:>12.3g}", u(4 * k + j));
      }
      text_ += fmt::format("{:>8.3g}\n", forecast.degrees_of_freedom(k));
    }
  }

  void add_angles() {
    const Forecast& forecast = *plan_.forecast;
    if (forecast.response.bias.size() < 3) {
      return;
    }
    const Eigen::MatrixXd C = forecast.covariance();
    text_ += fmt::format(
        "\nStandard uncertainty of calibrated angles [deg], before a new reading's "
        "own noise\n  {:<14}{:>12}{:>14}{:>12}\n",
        "pitch [deg]", "pitch", "pitch, atan2", "roll");
    for (const double pitch_deg : pitches_deg) {
      const double pitch = pitch_deg * rad_per_deg;
      const AngleUncertainty by_asin = forecast_angles(forecast, C, pitch, 0.0);
      const AngleUncertainty by_atan2 =
          forecast_angles(forecast, C, pitch, 0.0, PitchFormula::arctangent);
      text_ += fmt::format("  {:<14}{:>12.3g}{:>14.3g}{:>12.3g}\n", pitch_deg,
                           degrees(by_asin.pitch_rad), degrees(by_atan2.pitch_rad),
                           degrees(by_asin.roll_rad));
    }
    const auto part = [&](const char* name, const Eigen::MatrixXd& covariance) {
      text_ += fmt::format("  {:<54}{:>10.3g}\n", name,
                           degrees(largest_angle_uncertainty(forecast, covariance)));
    };
    part("largest, of the direction in any attitude", C);
    part("  by the noise", forecast.noise);
    if (!forecast.positioner.isZero(0.0)) {
      part("  by the cube (replicates do not lower it)", forecast.positioner);
    }
    if (!forecast.level.isZero(0.0)) {
      part("  by the table's level (replicates do not lower it)", forecast.level);
    }
  }

  void add_wanted() {
    if (!plan_.wanted_rad) {
      return;
    }
    const int samples = plan_.setup.samples;
    text_ += "\n" +
             wrapped(fmt::format("For {} degrees: {} replicate{} of {} sample{} a point, or 1 "
                                 "replicate of {} samples.",
                                 short_number(degrees(*plan_.wanted_rad)), plan_.replicates_needed,
                                 plan_.replicates_needed == 1 ? "" : "s", samples,
                                 samples == 1 ? "" : "s",
                                 static_cast<long>(plan_.replicates_needed) * samples),
                     80) +
             "\n";
  }

  void add_tolerances() {
    if (plan_.tolerances.empty()) {
      return;
    }
    text_ += fmt::format(
        "\nErrors by the cube's tolerances, root mean square [1e-6 of the field, urad]"
        "\n  {:<24}{:>10}{:>13}{:>12}{:>8}{:>11}\n",
        "method", "bias", "sensitivity", "cross-axis", "angle", "95 % of");
    for (const ToleranceEffect& effect : plan_.tolerances) {
      const auto micro = [](double value) { return std::round(1e8 * value) * 1e-2; };
      const auto row = [&](const std::string& name, const CalibrationErrors& errors) {
        text_ += fmt::format("  {:<24}{:>10.4g}{:>13.4g}{:>12.4g}{:>8.4g}", name,
                             micro(errors.bias), micro(errors.sensitivity),
                             micro(errors.cross_axis), micro(errors.angle_rad));
      };
      row(std::string(method_name(effect.method)) + ", closed form", effect.closed_form);
      text_ += "\n";
      row(std::string(method_name(effect.method)) + ", simulated", effect.simulated);
      text_ += fmt::format("{:>11.4g}\n", 1e6 * effect.worst_angle_95_rad);
    }
    text_ += "  (95 % of: no more than this in any attitude for 95 % of the cubes)\n";
    const int unusable = plan_.tolerances.front().unusable;
    if (unusable > 0) {
      text_ += fmt::format("  {} of the cubes could not be used\n", unusable);
    }
    if (!plan_.setup.positioner.feet(Face::plus_x)) {
      const BallFrame frame;
      text_ += wrapped(fmt::format(
                           "  Drawn as: edge {} mm, feet {} mm high of radius {} mm within {} "
                           "mm of the middle; --positioner takes another drawing.",
                           1e3 * frame.edge_m, 1e3 * frame.foot_height_m, 1e3 * frame.ball_radius_m,
                           1e3 * frame.foot_positions_m[0].cwiseAbs().maxCoeff()),
                       80) +
               "\n";
    }
  }

  const Plan& plan_;
  std::string text_;
};

Json json_of(const CalibrationErrors& errors) {
  return {{"bias", errors.bias},
          {"sensitivity", errors.sensitivity},
          {"cross_axis", errors.cross_axis},
          {"angle_rad", errors.angle_rad}};
}

std::string plan_json(const Plan& plan) {
  const DesignQuality& quality = plan.quality;
  Json json = {{"design_points", plan.setup.design.size()},
               {"replicates", plan.setup.replicates},
               {"samples", plan.setup.samples},
               {"method", method_name(plan.setup.method)}};
  json["design"] = {
      {"d_efficiency", quality.d_efficiency},
      {"a_efficiency", quality.a_efficiency},
      {"g_efficiency", quality.g_efficiency},
      {"largest_prediction_variance", quality.largest_prediction_variance / plan.setup.replicates},
      {"variance_inflation", json_from(quality.variance_inflation)}};
  if (plan.optimal) {
    json["optimal"] = {{"d_efficiency", plan.optimal->d_efficiency},
                       {"d_efficiency_of_12", plan.optimal->d_efficiency_of_standard}};
  }
  if (plan.forecast) {
    const Forecast& forecast = *plan.forecast;
    const Eigen::VectorXd u = forecast.covariance().diagonal().cwiseSqrt();
    const Eigen::Index m = forecast.response.bias.size();
    Eigen::VectorXd bias(m);
    Eigen::MatrixXd sensitivity(m, 3);
    for (Eigen::Index k = 0; k < m; ++k) {
      bias(k) = u(4 * k);
      sensitivity.row(k) = u.segment<3>(4 * k + 1);
    }
    Json& own = json["forecast"];
    own["standard_uncertainty"] = {{"bias", json_from(bias)},
                                   {"sensitivity", json_from_matrix(sensitivity)}};
    own["degrees_of_freedom"] = json_from(forecast.degrees_of_freedom);
    own["covariance"] = json_from_matrix(forecast.covariance());
    if (m >= 3) {
      const Eigen::MatrixXd C = forecast.covariance();
      own["angle_u_deg"] = degrees(largest_angle_uncertainty(forecast, C));
      own["angles"] = Json::array();
      for (const double pitch_deg : pitches_deg) {
        const double pitch = pitch_deg * rad_per_deg;
        const AngleUncertainty by_asin = forecast_angles(forecast, C, pitch, 0.0);
        const AngleUncertainty by_atan2 =
            forecast_angles(forecast, C, pitch, 0.0, PitchFormula::arctangent);
        own["angles"].push_back({{"pitch_deg", pitch_deg},
                                 {"roll_deg", 0.0},
                                 {"u_pitch_deg", degrees(by_asin.pitch_rad)},
                                 {"u_pitch_atan2_deg", degrees(by_atan2.pitch_rad)},
                                 {"u_roll_deg", degrees(by_asin.roll_rad)}});
      }
    }
  }
  if (plan.wanted_rad) {
    json["wanted"] = {{"angle_u_deg", degrees(*plan.wanted_rad)},
                      {"replicates", plan.replicates_needed}};
  }
  for (const ToleranceEffect& effect : plan.tolerances) {
    json["tolerances"][std::string(method_name(effect.method))] = {
        {"closed_form", json_of(effect.closed_form)},
        {"simulated", json_of(effect.simulated)},
        {"worst_angle_95_rad", effect.worst_angle_95_rad}};
  }
  return json_text(json);
}

std::vector<std::string> remarks_on(const ForecastSetup& setup) {
  std::set<DesignPoint> points;
  for (const DesignEntry& entry : setup.design) {
    points.insert(entry.point);
  }
  std::vector<std::string> remarks = rocking_remarks(setup.positioner, points);
  if (setup.method == Method::known && !(setup.level_u_rad > 0.0)) {
    remarks.emplace_back(
        "Method known takes the table's slope as exactly known; --level-u says how well it is.");
  }
  return remarks;
}

void check_outputs(const PlanCommand& command) {
  if (command.page == "-") {
    throw UsageError("--page: needs a file; standard output is for the sheet and the forecast");
  }
  if (command.page && command.page == command.output) {
    throw UsageError("--page: the page and the sheet need files of their own");
  }
  if (command.trials && !command.tolerances) {
    throw UsageError("--trials: goes with --tolerances");
  }
  for (const std::string& output : {command.output.value_or("-"), command.page.value_or("-")}) {
    for (const std::optional<std::string>& input :
         {command.experiment, command.positioner, std::optional(command.sheet.design)}) {
      if (input) {
        forbid_overwriting(output, *input);
      }
    }
  }
}

// The replicates that the wanted uncertainty needs.
int needed_replicates(const ForecastSetup& setup, double wanted_rad, bool makes_sheet) {
  constexpr int longest_sheet = 1000;
  const std::optional<double> needed = replicates_for_angle(setup, wanted_rad);
  if (!needed) {
    ForecastSetup silent = setup;
    silent.noise_sd = 0.0;
    const Forecast rest = forecast(silent);
    throw RefusedError(
        "--want-angle-deg: no number of replicates reaches " + short_number(degrees(wanted_rad)) +
        " degrees: the cube and the table's level alone leave " +
        short_number(degrees(largest_angle_uncertainty(rest, rest.covariance()))) +
        "; measure the cube better (characterize), or the level (method paired or joint)");
  }
  if (makes_sheet && *needed > longest_sheet) {
    throw RefusedError("--want-angle-deg: " + short_number(degrees(wanted_rad)) + " degrees need " +
                       fmt::format("{:.0f}", *needed) + " replicates of " +
                       std::to_string(setup.samples) +
                       " samples a point; average more samples at each point (--samples), or state "
                       "--replicates");
  }
  return static_cast<int>(std::min(*needed, 1e9));
}

}  // namespace

int run(const PlanCommand& command) {
  if (command.json && command.output == "-") {
    throw UsageError("-o -: standard output cannot hold both the sheet and the forecast's JSON");
  }
  if (command.want_angle && !command.noise) {
    throw UsageError("--want-angle-deg: the noise of a sample is needed too (--noise)");
  }
  check_outputs(command);
  const Experiment experiment = planned_experiment(command);
  const std::vector<DesignEntry> design = design_of(command.sheet);
  Plan plan;
  plan.setup = forecast_setup(command, experiment, design);
  plan.remarks = remarks_on(plan.setup);
  const Eigen::Vector3d field =
      plan.setup.nominal.field.in_table.value_or(Eigen::Vector3d(Eigen::Vector3d::UnitZ()));
  plan.quality = assess_design(design, experiment.positioner, field);
  if (command.sheet.design.starts_with("optimal:")) {
    plan.optimal = optimal_design(static_cast<int>(design.size()), Eigen::Vector3d::UnitZ(),
                                  seed_of(command.sheet));
  }
  if (command.want_angle) {
    const double wanted_deg = number_of("--want-angle-deg", *command.want_angle);
    if (!(wanted_deg > 0.0)) {
      throw UsageError("--want-angle-deg: must be positive");
    }
    plan.wanted_rad = wanted_deg * rad_per_deg;
    plan.replicates_needed =
        needed_replicates(plan.setup, *plan.wanted_rad, !command.sheet.replicates);
    if (!command.sheet.replicates) {
      plan.setup.replicates = plan.replicates_needed;
    }
  }
  if (command.noise) {
    plan.forecast = forecast(plan.setup);
  }
  if (command.tolerances) {
    plan.tolerances = study_tolerances(tolerance_study(command, plan.setup, experiment.positioner));
  }
  const std::vector<RunSheetRow> sheet =
      make_run_sheet(design, plan.setup.replicates, seed_of(command.sheet));
  // Standard output holds the sheet or the forecast: the one that was asked for.
  const bool forecast_to_stdout = command.output.value_or("-") != "-" || command.json;
  if (command.output || !command.json) {
    write_whole_file(command.output.value_or("-"), run_sheet_csv(sheet));
  }
  if (command.page) {
    const std::string& serial = experiment.instrument.serial;
    write_whole_file(*command.page,
                     run_sheet_page(sheet, "Run sheet" + (serial.empty() ? "" : " of " + serial)));
  }
  const std::string text = command.json ? plan_json(plan) : PlanText(plan).text();
  if (forecast_to_stdout) {
    write_whole_file("-", text);
  } else {
    std::fputs(text.c_str(), stderr);
  }
  return 0;
}

}  // namespace axiscal::cli
