// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "subcommands.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

struct BudgetCommand {
  std::string record;
  std::optional<std::string> pitch, roll, temperature, noise, map, monte_carlo, seed, pitch_formula;
  std::string output = "-";
  bool json = false;
};

void add_options(OptionSet& options, BudgetCommand& command) {
  options.add("record", command.record, "RECORD", "calibration record (JSON)", Need::required);
  options.add("--pitch", command.pitch, "DEG", "pitch of the attitude");
  options.add("--roll", command.roll, "DEG", "roll of the attitude [default: 0]");
  options.add("--temperature", command.temperature, "T",
              "temperature of the sensor [default: the record's reference]");
  options.add("--noise", command.noise, "SD",
              "standard deviation of a reading [default: the scatter of the calibration]");
  options.add("--pitch-formula", command.pitch_formula, "asin|atan2",
              "formula of pitch: asin(f_x / F), or atan2, which does not use F [default: asin]");
  options.add("--attitudes,--map", command.map, "DEG",
              "table of the expanded uncertainty of pitch and roll over all attitudes, in steps of "
              "DEG");
  options.add("--monte-carlo", command.monte_carlo, "N",
              "check the linear propagation of the uncertainties in the attitude by a Monte Carlo "
              "simulation with N trials (JCGM 101)");
  options.add("--seed", command.seed, "S", "seed of the trials [default: 1]");
  options.add_output(command.output);
  options.add_flag("--json", command.json, "print JSON instead of tables");
}

struct Asked {
  ReductionOptions reduction;
  ReadingNoise noise;
  std::optional<double> temperature;
};

// The output of the command, as text and as JSON.
struct Shown {
  std::string text;
  Json json;
};

Json json_of(const CombinedUncertainty& uncertainty, const std::vector<std::string>& sources) {
  Json json = {{"u", uncertainty.u},
               {"degrees_of_freedom", uncertainty.degrees_of_freedom},
               {"coverage_factor_95", uncertainty.coverage_factor},
               {"expanded_95", uncertainty.expanded},
               {"by_source", Json::object()}};
  for (std::size_t s = 0; s < sources.size() && s < uncertainty.by_source.size(); ++s) {
    json["by_source"][sources[s]] = uncertainty.by_source[s];
  }
  return json;
}

std::string header(const std::vector<std::string>& sources) {
  std::string text =
      formatted("  {:<20}{:>14}{:>11}{:>7}{:>6}{:>11}", "", "value", "u", "dof", "k", "U (95 %)");
  for (const std::string& source : sources) {
    text += formatted("{:>{}}", source, std::max<std::size_t>(source.size() + 2, 11));
  }
  return text + "\n";
}

std::string line(const std::string& name,
                 double value,
                 const CombinedUncertainty& uncertainty,
                 const std::vector<std::string>& sources) {
  const double dof = uncertainty.degrees_of_freedom;
  std::string text = formatted("  {:<20}{:>14.7g}{:>11.2g}{:>7}{:>6.2f}{:>11.2g}", name, value,
                               uncertainty.u, dof < 1e4 ? formatted("{:.1f}", dof) : "inf",
                               uncertainty.coverage_factor, uncertainty.expanded);
  for (std::size_t s = 0; s < sources.size(); ++s) {
    text += formatted("{:>{}.2g}", uncertainty.by_source[s],
                      std::max<std::size_t>(sources[s].size() + 2, 11));
  }
  return text + "\n";
}

std::vector<std::string> sources_of(const Calibration& calibration) {
  std::vector<std::string> names;
  if (!calibration.fit.uncertainty) {
    return {"fit"};
  }
  for (const UncertaintySource& source : calibration.fit.uncertainty->sources) {
    names.push_back(source.name);
  }
  return names;
}

// Shows the sources of uncertainty. For each source it shows the type, the distribution, the
// standard uncertainty of the input and the largest sensitivity coefficient.
void show_sources(const Calibration& calibration, Shown& shown) {
  if (!calibration.fit.uncertainty) {
    return;
  }
  shown.text += "Sources\n";
  shown.json["sources"] = Json::array();
  for (const UncertaintySource& source : calibration.fit.uncertainty->sources) {
    Json json = {{"name", source.name},
                 {"type", source.type},
                 {"distribution", source.distribution},
                 {"input_u", source.input_u},
                 {"input_unit", source.input_unit}};
    shown.text += formatted("  {:<18} type {}, {}", source.name, source.type, source.distribution);
    if (source.covariance.size() > 0 && source.input_u > 0.0) {
      // The sensitivity coefficient of a parameter is the source's contribution to the parameter's
      // standard uncertainty, divided by the standard uncertainty of the input.
      const Eigen::VectorXd c = source.covariance.diagonal().cwiseSqrt() / source.input_u;
      json["sensitivity_coefficients"] = json_from(c);
      shown.text += formatted(", u {:.3g} {}, sensitivity coefficients up to {:.3g}",
                              source.input_u, source.input_unit, c.maxCoeff());
    }
    shown.text += "\n";
    shown.json["sources"].push_back(std::move(json));
  }
  shown.text += "\n";
}

void show_parameters(const Calibration& calibration, Shown& shown) {
  const std::vector<std::string> sources = sources_of(calibration);
  shown.text +=
      "Coefficients, and their standard uncertainties u from each "
      "source\n" +
      header(sources);
  shown.json["parameters"] = Json::array();
  for (const ParameterUncertainty& one : parameter_uncertainties(calibration)) {
    shown.text += line(one.name, one.value, one.uncertainty, sources);
    Json json = json_of(one.uncertainty, sources);
    json["parameter"] = one.name;
    json["value"] = one.value;
    shown.json["parameters"].push_back(std::move(json));
  }
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  shown.text += "\nQuantities independent of the mounting (angles in degrees)\n";
  shown.json["intrinsic"] = {{"names", intrinsic.names},
                             {"values", json_from(intrinsic.values)},
                             {"covariance", json_from_matrix(intrinsic.covariance)}};
  for (std::size_t i = 0; i < intrinsic.uncertainty.size(); ++i) {
    const double unit = intrinsic.names[i].starts_with("angle.") ? deg_per_rad : 1.0;
    CombinedUncertainty uncertainty = intrinsic.uncertainty[i];
    uncertainty.u *= unit;
    uncertainty.expanded *= unit;
    for (double& u : uncertainty.by_source) {
      u *= unit;
    }
    shown.text += line(intrinsic.names[i], unit * intrinsic.values(static_cast<Eigen::Index>(i)),
                       uncertainty, sources);
  }
}

void show_attitude(const Calibration& calibration,
                   const Asked& asked,
                   const Eigen::Vector3d& field,
                   Shown& shown) {
  const AttitudeBudget budget =
      attitude_budget(calibration, asked.reduction, asked.noise, field, asked.temperature);
  shown.text += "\nOne reading in this attitude\n" + header(budget.sources);
  shown.json["attitude"] = Json::array();
  for (const AttitudeQuantity& quantity : budget.quantities) {
    shown.text += line(quantity.name, quantity.value, quantity.uncertainty, budget.sources);
    Json json = json_of(quantity.uncertainty, budget.sources);
    json["name"] = quantity.name;
    json["value"] = quantity.value;
    const Advice advice = advice_to_halve(quantity.uncertainty, budget.sources,
                                          calibration.fit.statistics->observations);
    json["dominant"] = {
        {"source", advice.source}, {"share", advice.share}, {"advice", advice.text}};
    shown.json["attitude"].push_back(std::move(json));
  }
  for (const AttitudeQuantity& quantity : budget.quantities) {
    if (quantity.name != "residual") {
      const Advice advice = advice_to_halve(quantity.uncertainty, budget.sources,
                                            calibration.fit.statistics->observations);
      if (!advice.source.empty()) {
        shown.text += formatted("  {}: {:.0f} % of the variance is from '{}'; {}\n", quantity.name,
                                100.0 * advice.share, advice.source, advice.text);
      }
    }
  }
}

void show_monte_carlo(const Calibration& calibration,
                      const Asked& asked,
                      const Eigen::Vector3d& field,
                      int trials,
                      std::uint64_t seed,
                      Shown& shown) {
  const std::vector<MonteCarloCheck> checks = check_by_monte_carlo(
      calibration, asked.reduction, asked.noise, field, trials, seed, asked.temperature);
  shown.text += formatted(
      "\n"
      "Monte Carlo, {} trials: range that contains 95 % of the errors\n  "
      "{:<20}{:>12}{:>12}{:>12}\n",
      trials, "", "from", "to", "linear +-");
  shown.json["monte_carlo"] = Json::array();
  for (const MonteCarloCheck& check : checks) {
    shown.text += formatted("  {:<20}{:>12.3g}{:>12.3g}{:>12.3g}{}\n", check.name, check.low_95,
                            check.high_95, check.linear_expanded,
                            check.agrees ? ""
                                         : "  linear value differs: use the range of the "
                                           "trials (from, to)");
    shown.json["monte_carlo"].push_back({{"name", check.name},
                                         {"mean_error", check.mean_error},
                                         {"sd", check.sd},
                                         {"low_95", check.low_95},
                                         {"high_95", check.high_95},
                                         {"linear_u", check.linear_u},
                                         {"linear_expanded_95", check.linear_expanded},
                                         {"agrees", check.agrees}});
  }
}

// Shows the expanded uncertainties of pitch and roll for a grid of attitudes. If pitch is near +-90
// degrees, it shows the uncertainty of yaw instead of roll.
void show_map(const Calibration& calibration, const Asked& asked, double step_deg, Shown& shown) {
  std::string pitch_text = "\nU (95 %) of pitch [deg]; rows: pitch, columns: roll\n";
  std::string roll_text = "\nU (95 %) of roll, or of yaw near +-90 degrees of pitch [deg]\n";
  std::string head = formatted("  {:>6}", "");
  for (double roll = -180.0; roll < 180.0 - 1e-9; roll += step_deg) {
    head += formatted("{:>9.0f}", roll);
  }
  pitch_text += head + "\n";
  roll_text += head + "\n";
  shown.json["map"] = Json::array();
  for (double pitch = -90.0; pitch <= 90.0 + 1e-9; pitch += step_deg) {
    pitch_text += formatted("  {:>6.0f}", pitch);
    roll_text += formatted("  {:>6.0f}", pitch);
    for (double roll = -180.0; roll < 180.0 - 1e-9; roll += step_deg) {
      const AttitudeBudget budget = attitude_budget(
          calibration, asked.reduction, asked.noise,
          field_of_attitude(calibration.sensor, pitch * rad_per_deg, roll * rad_per_deg),
          asked.temperature);
      Json one = {{"pitch_deg", pitch}, {"roll_deg", roll}};
      for (const AttitudeQuantity& quantity : budget.quantities) {
        one["expanded_95"][quantity.name] = quantity.uncertainty.expanded;
        if (quantity.name == "pitch_deg") {
          pitch_text += formatted("{:>9.2g}", quantity.uncertainty.expanded);
        } else if (quantity.name == "roll_deg" || quantity.name == "yaw_deg") {
          roll_text += formatted("{:>9.2g}", quantity.uncertainty.expanded);
        }
      }
      shown.json["map"].push_back(std::move(one));
    }
    pitch_text += "\n";
    roll_text += "\n";
  }
  shown.text += pitch_text + roll_text;
}

Asked asked_of(const BudgetCommand& command, const Calibration& calibration) {
  Asked asked;
  asked.noise = stated_noise(calibration);
  if (command.noise) {
    asked.noise.sd = Eigen::VectorXd::Constant(calibration.sensor.instrument.axis_count(),
                                               parse_nonnegative("--noise", *command.noise));
  }
  if (command.temperature) {
    asked.temperature = number_of("--temperature", *command.temperature);
  }
  if (command.pitch_formula) {
    asked.reduction.inclination.pitch_formula =
        pitch_formula_of("--pitch-formula", *command.pitch_formula);
  }
  asked.reduction.magnitude = calibration.sensor.field.magnitude;
  return asked;
}

int run(const BudgetCommand& command) {
  const Calibration calibration = in_assembly_frame(read_calibration(command.record));
  if (parameter_uncertainties(calibration).empty()) {
    throw DataError(
        command.record, "/statistics",
        "the record lacks the covariance of its coefficients, so a budget cannot be made");
  }
  const Asked asked = asked_of(command, calibration);
  if (command.roll && !command.pitch) {
    throw UsageError("--roll: requires --pitch");
  }
  if (command.monte_carlo && !command.pitch) {
    throw UsageError("--monte-carlo: requires an attitude (--pitch DEG --roll DEG)");
  }
  Shown shown;
  try {
    show_sources(calibration, shown);
    show_parameters(calibration, shown);
    if (command.pitch) {
      const double pitch = number_of("--pitch", *command.pitch);
      if (!(std::abs(pitch) <= 90.0)) {
        throw UsageError("--pitch: must be from -90 to 90 degrees");
      }
      const double roll = command.roll ? number_of("--roll", *command.roll) : 0.0;
      const Eigen::Vector3d field =
          field_of_attitude(calibration.sensor, pitch * rad_per_deg, roll * rad_per_deg);
      show_attitude(calibration, asked, field, shown);
      if (command.monte_carlo) {
        const int trials = parse_whole_number("--monte-carlo", *command.monte_carlo, 1000);
        const int seed = command.seed ? parse_whole_number("--seed", *command.seed, 0) : 1;
        show_monte_carlo(calibration, asked, field, trials, static_cast<std::uint64_t>(seed),
                         shown);
      }
    }
    if (command.map) {
      const double step = number_of("--attitudes", *command.map);
      if (!(step >= 1.0 && step <= 90.0)) {
        throw UsageError("--attitudes: the step must be from 1 to 90 degrees");
      }
      show_map(calibration, asked, step, shown);
    }
  } catch (const DomainError& error) {
    throw DataError(command.record, error.what(), error.settings());
  }
  shown.json["not_counted"] = not_counted(calibration);
  if (const std::string missing = not_counted_sentence(calibration); !missing.empty()) {
    shown.text += "\n" + wrapped(missing, 80) + "\n";
  }
  write_text(command.output, command.json ? json_text(shown.json) : shown.text);
  return 0;
}

}  // namespace

Subcommand budget_subcommand() {
  return make_subcommand<BudgetCommand>(
      "budget", "list the uncertainties of a record by their sources", "", &add_options, &run);
}

}  // namespace axiscal::cli
