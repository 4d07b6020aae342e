// SPDX-License-Identifier: Apache-2.0
#include "plan_text.hpp"

#include <array>
#include <cmath>

#include "axiscal/core/units.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "summary.hpp"

namespace axiscal::cli {
namespace {

// Pitch angles for which the forecast is printed.
constexpr std::array<double, 4> pitches_deg = {0.0, 45.0, 80.0, 85.0};

double degrees(double radian) {
  return radian * deg_per_rad;
}

std::string short_number(double value) {
  return std::isfinite(value) ? formatted("{:.4g}", value) : "-";
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
      text_ += "\nNo forecast: give the noise of a sample with --noise.\n";
    }
    add_wanted();
    add_tolerances();
    for (const std::string& remark : plan_.remarks) {
      text_ += formatted("\n{}\n", wrapped(remark, 80));
    }
    return text_;
  }

 private:
  void add_design() {
    const ForecastSetup& setup = plan_.setup;
    const DesignQuality& quality = plan_.quality;
    text_ += formatted("{} design points, {} replicate{}: {} readings, method {}\n",
                       setup.design.size(), setup.replicates, setup.replicates == 1 ? "" : "s",
                       setup.design.size() * static_cast<std::size_t>(setup.replicates),
                       method_name(setup.method));
    if (!quality.determined) {
      text_ += "The design does not determine all coefficients.\n";
      return;
    }
    text_ += formatted(
        "efficiency (1 is the optimum for {} points): D {:.3f}, A {:.3f}, G {:.3f}\n",
        setup.design.size(), quality.d_efficiency, quality.a_efficiency, quality.g_efficiency);
    text_ += formatted(
        "variance inflation factors of x, y, z: {:.3f}, {:.3f}, "
        "{:.3f}\n",
        quality.variance_inflation.x(), quality.variance_inflation.y(),
        quality.variance_inflation.z());
    text_ += wrapped(formatted("the largest prediction variance is {:.4g} times the variance of a "
                               "reading, for a field along ({:.2f}, {:.2f}, {:.2f})",
                               quality.largest_prediction_variance / setup.replicates,
                               quality.worst_direction.x(), quality.worst_direction.y(),
                               quality.worst_direction.z()),
                     80);
    text_ += "\n";
    if (plan_.optimal) {
      text_ +=
          wrapped(formatted("D-optimal design of {} of the 24 points, for {}: its D-efficiency is "
                            "{:.4f}; the 12-point design has {:.4f}",
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
    text_ += formatted(
        "\nForecast: standard uncertainty (root mean square error) of bias [{0}] and of\n"
        "sensitivity to x, y, z [{0} per {1}]\n"
        "  {2:<12}{3:>12}{4:>12}{5:>12}{6:>12}{7:>8}\n",
        instrument.unit, plan_.setup.nominal.field.unit, "axis", "bias", "x", "y", "z", "dof");
    for (Eigen::Index k = 0; k < forecast.response.bias.size(); ++k) {
      text_ += formatted("  {:<12}", instrument.axes[static_cast<std::size_t>(k)].substr(0, 11));
      for (Eigen::Index j = 0; j < 4; ++j) {
        text_ += formatted("{:>12.3g}", u(4 * k + j));
      }
      text_ += formatted("{:>8.3g}\n", forecast.degrees_of_freedom(k));
    }
  }

  void add_angles() {
    const Forecast& forecast = *plan_.forecast;
    if (forecast.response.bias.size() < 3) {
      return;
    }
    const Eigen::MatrixXd C = forecast.covariance();
    text_ += formatted(
        "\nStandard uncertainty of calibrated angles [deg], without the noise of a reading\n"
        "  {:<14}{:>12}{:>14}{:>12}\n",
        "pitch [deg]", "pitch", "pitch, atan2", "roll");
    for (const double pitch_deg : pitches_deg) {
      const double pitch = pitch_deg * rad_per_deg;
      const AngleUncertainty by_asin = forecast_angles(forecast, C, pitch, 0.0);
      const AngleUncertainty by_atan2 =
          forecast_angles(forecast, C, pitch, 0.0, PitchFormula::arctangent);
      text_ +=
          formatted("  {:<14}{:>12.3g}{:>14.3g}{:>12.3g}\n", pitch_deg, degrees(by_asin.pitch_rad),
                    degrees(by_atan2.pitch_rad), degrees(by_asin.roll_rad));
    }
    const auto part = [&](const char* name, const Eigen::MatrixXd& covariance) {
      text_ += formatted("  {:<54}{:>10.3g}\n", name,
                         degrees(largest_angle_uncertainty(forecast, covariance)));
    };
    part("largest uncertainty of a direction, over all attitudes", C);
    part("  from the noise", forecast.noise);
    if (!forecast.positioner.isZero(0.0)) {
      part("  from the cube (not reduced by replicates)", forecast.positioner);
    }
    if (!forecast.mount.isZero(0.0)) {
      part("  from the mount (not reduced by replicates)", forecast.mount);
    }
    if (!forecast.level.isZero(0.0)) {
      part("  from the table's level (not reduced by replicates)", forecast.level);
    }
  }

  void add_wanted() {
    if (!plan_.wanted_rad) {
      return;
    }
    const int samples = plan_.setup.samples;
    text_ += formatted(
        "\n{}\n",
        wrapped(formatted("{} degrees are reached by {} replicate{} of {} sample{} per point, or "
                          "by 1 replicate of {} samples per point.",
                          short_number(degrees(*plan_.wanted_rad)), plan_.replicates_needed,
                          plan_.replicates_needed == 1 ? "" : "s", samples, samples == 1 ? "" : "s",
                          static_cast<long>(plan_.replicates_needed) * samples),
                80));
  }

  void add_tolerances() {
    if (plan_.tolerances.empty()) {
      return;
    }
    text_ += formatted(
        "\n"
        "Root mean square errors due to the cube's tolerances [1e-6 of the field, urad]\n"
        "  {:<24}{:>10}{:>13}{:>12}{:>8}{:>11}\n",
        "method", "bias", "sensitivity", "cross-axis", "angle", "95 % of");
    for (const ToleranceEffect& effect : plan_.tolerances) {
      const auto micro = [](double value) { return std::round(1e8 * value) * 1e-2; };
      const auto row = [&](const std::string& name, const CalibrationErrors& errors) {
        text_ +=
            formatted("  {:<24}{:>10.4g}{:>13.4g}{:>12.4g}{:>8.4g}", name, micro(errors.bias),
                      micro(errors.sensitivity), micro(errors.cross_axis), micro(errors.angle_rad));
      };
      row(std::string(method_name(effect.method)) + ", closed form", effect.closed_form);
      text_ += "\n";
      row(std::string(method_name(effect.method)) + ", simulated", effect.simulated);
      text_ += formatted("{:>11.4g}\n", 1e6 * effect.worst_angle_95_rad);
    }
    text_ += "  (column '95 % of': in 95 % of the cubes, no attitude has a larger angle error)\n";
    const int unusable = plan_.tolerances.front().unusable;
    if (unusable > 0) {
      text_ += formatted(
          "  {} of the simulated cubes are left out, because their errors are too "
          "large\n",
          unusable);
    }
    if (!plan_.setup.positioner.feet(Face::plus_x)) {
      const BallFrame frame;
      text_ += wrapped(formatted(
                           "  Assumed drawing: edge {} mm; ball feet {} mm high, with radius {} "
                           "mm, at most {} mm from the middle of the face along each axis. "
                           "--positioner sets another drawing.",
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

}  // namespace

std::string plan_text(const Plan& plan) {
  return PlanText(plan).text();
}

std::string short_degrees(double radian) {
  return short_number(degrees(radian));
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

}  // namespace axiscal::cli
