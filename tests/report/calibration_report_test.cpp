// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/calibration_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/report/noise_report.hpp"
#include "report/src/html.hpp"
#include "report/src/plot.hpp"
#include "report/src/report_plots.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;
using testing::Not;

Calibration calibrated(double noise_sd = 1e-4) {
  const SensorModel truth = accelerometer_truth();
  return calibrate(
      experiment_for(truth),
      observe(truth, {.replicates = 2, .slope = {0.003, -0.002}, .noise_sd = noise_sd}));
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++count;
  }
  return count;
}

TEST(CalibrationReport, ShowsWhatThereIs) {
  const std::string page = calibration_report(calibrated());
  EXPECT_THAT(page, HasSubstr("class=\"verdict ok\""));
  for (const char* const id :
       {"run", "points", "coefficients", "residuals", "levelness", "uncertainty"}) {
    EXPECT_THAT(page, HasSubstr("<section id=\"" + std::string(id) + "\">")) << id;
    EXPECT_THAT(page, HasSubstr("href=\"#" + std::string(id) + "\"")) << id;
  }
  for (const char* const id : {"temperature", "turns", "history"}) {
    EXPECT_THAT(page, Not(HasSubstr("<section id=\"" + std::string(id) + "\">"))) << id;
  }
  EXPECT_EQ(count_of(page, "class=\"seats\""), 1U);
  EXPECT_EQ(count_of(page, "<li><svg viewBox=\"0 0 200 190\""), 12U);
  // Each drawing has a text alternative and a data table.
  EXPECT_EQ(count_of(page, "<svg class=\"drawn\""), count_of(page, "<details><summary>Data"));
  EXPECT_EQ(count_of(page, "<svg class=\"drawn\""),
            count_of(page.substr(0, page.find("<script")), "role=\"img\" aria-label") - 12U);
}

// For a mirrored instrument the rotation is stated relative to the half turn.
TEST(CalibrationReport, AlignmentsHaveTheirTable) {
  Calibration calibration = calibrated();
  EXPECT_THAT(calibration_report(calibration), Not(HasSubstr("instruments relative to this one")));
  const Eigen::Matrix3d half_turn = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
  calibration.fit.slot_alignments = {
      {.slot = "R",
       .rotation_other_from_sensor = rotation_by({0.00125, 0.0, 0.0}) * half_turn,
       .u_rad = Eigen::Vector3d::Constant(1e-4),
       .expanded_rad = Eigen::Vector3d::Constant(2.1e-4)}};
  const std::string page = calibration_report(calibration);
  EXPECT_THAT(page, HasSubstr("instruments relative to this one [mrad]"));
  EXPECT_THAT(page, HasSubstr(">1.25<"));
  EXPECT_THAT(page, HasSubstr(">0.21<"));
}

TEST(PlotOfEqualValues, IsDrawnAlsoIfTheyDifferByRounding) {
  const double value = 0.25;
  const Plot plot{
      .id = "equal",
      .title = "Equal values",
      .alternative = "Two values that differ by rounding",
      .x_label = "unit",
      .y_label = "value",
      .series = {{.name = "units", .x = {1.0, 2.0}, .y = {value, std::nextafter(value, 1.0)}}}};
  const std::string figure = Figures::add(plot);
  EXPECT_THAT(figure, HasSubstr("Equal values"));
  EXPECT_LT(figure.size(), 10000U);
}

TEST(Cloud, IsThinnedEvenly) {
  Plot plot{.id = "cloud", .equal_aspect = true};
  PlotSeries all{.name = "all"};
  for (const Eigen::Vector3d& u : directions_on_sphere(20000)) {
    all.x.push_back(u.x());
    all.y.push_back(u.z());
  }
  plot.series = {all};
  const Plot thin = thinned(plot);
  std::array<int, 10> bands{};
  for (const double y : thin.series.front().y) {
    ++bands.at(static_cast<std::size_t>(std::min(9.0, 5.0 * (y + 1.0))));
  }
  const double mean = static_cast<double>(thin.series.front().y.size()) / 10.0;
  EXPECT_GT(mean, 40.0);
  for (const int band : bands) {  // z is uniform on a sphere
    EXPECT_NEAR(band, mean, 0.3 * mean);
  }
  EXPECT_EQ(thin.note, "one of every 34 points is drawn");
}

// The page begins with verdict, matrix and picture. The rest is folded.
TEST(CalibrationReport, ShowsTheCoefficientsAsAMatrix) {
  const Calibration calibration = calibrated();
  const std::string page = calibration_report(calibration);
  const std::size_t matrix = page.find("<section id=\"coefficients\"><h2>");
  const std::size_t story = page.find("<section id=\"story\"><h2>");
  ASSERT_NE(matrix, std::string::npos);
  ASSERT_NE(story, std::string::npos);
  EXPECT_LT(page.find("class=\"verdict"), matrix);
  EXPECT_LT(matrix, story);
  EXPECT_LT(story, page.find("<details class=\"part\">"));
  const Quantity bias = calibration.parameter("y.bias");
  EXPECT_THAT(page, HasSubstr(typographic_minus(rounded_value(bias.value, bias.U)) +
                              " \u00b1\u00a0" + rounded_uncertainty(bias.U) + "<"));
  for (const char* const id : {"measured-plot", "axes-figure", "slope-plot"}) {
    EXPECT_THAT(page.substr(story), HasSubstr("<figure id=\"" + std::string(id) + "\">"));
  }
}

TEST(QuantityCells, StandBelowEachOtherAtTheDecimalPoint) {
  const std::vector<Cell> cells =
      quantity_cells({{4.09, 0.11}, {-0.395, 0.021}, {9956.0, 79.0}, {1.0, std::nan("")}});
  const auto in = [](const Cell& cell) { return cell.text; };
  const std::string figure = "\u2007";
  const std::string point = "\u2008";
  EXPECT_EQ(in(cells[0]), figure + figure + figure + "4.09" + figure + " \u00b1\u00a0" + figure +
                              "0.11" + figure);
  EXPECT_EQ(in(cells[1]), figure + figure + "\u22120.395 \u00b1\u00a0" + figure + "0.021");
  EXPECT_EQ(in(cells[2]), "9956" + point + figure + figure + figure + " \u00b1\u00a079" + point +
                              figure + figure + figure);
  EXPECT_EQ(cells[1].value, "-0.395");
}

TEST(CalibrationReport, LeavesALeverageWithoutMeaningOut) {
  const SensorModel truth = accelerometer_truth();
  Experiment experiment = experiment_for(truth);
  experiment.fit.method = Method::paired;
  const Calibration few =
      calibrate(experiment, observe(truth, {.slope = {0.003, -0.002}, .noise_sd = 1e-4}));
  ASSERT_NEAR(few.fit.statistics->degrees_of_freedom(0), 2.0, 1e-9);
  EXPECT_THAT(calibration_report(few), Not(HasSubstr("leverage")));
}

// A page of thousands of readings stays small, and states what it leaves out.
TEST(CalibrationReport, OfManyReadingsStaysSmall) {
  // A record of 24 readings whose readings are repeated 800 times, because calibrate() is not
  // tested here.
  const SensorModel truth = accelerometer_truth();
  const Observations few =
      observe(truth, {.replicates = 2, .slope = {0.003, -0.002}, .noise_sd = 1e-4});
  Calibration calibration = calibrate(experiment_for(truth), few);
  const std::vector<ReadingResidual> residuals = calibration.fit.residuals;
  const std::vector<RegressionRow> rows = calibration.fit.statistics->rows;
  Observations observations;
  observations.response = few.response.replicate(800, 1);
  RandomStream random(2);
  for (int copy = 1; copy < 800; ++copy) {
    for (ReadingResidual residual : residuals) {
      residual.run = static_cast<int>(calibration.fit.residuals.size()) + 1;
      residual.response *= random.normal();
      calibration.fit.residuals.push_back(residual);
    }
    calibration.fit.statistics->rows.insert(calibration.fit.statistics->rows.end(), rows.begin(),
                                            rows.end());
  }
  FitStatistics& statistics = *calibration.fit.statistics;
  for (Eigen::MatrixXd* const of_rows :
       {&statistics.leverage, &statistics.studentized, &statistics.cooks_distance}) {
    *of_rows = of_rows->replicate(800, 1).eval();
  }
  calibration.fit.residuals[7777].response *= 50.0;
  for (const ReadingResidual& residual : calibration.fit.residuals) {
    observations.readings.push_back({.run = residual.run, .point = residual.point});
  }
  ReportOptions options;
  options.observations = &observations;
  const std::string page = calibration_report(calibration, options);
  EXPECT_LT(page.size(), 3U << 20U);
  const auto has = [&](const char* text) { return page.find(text) != std::string::npos; };
  EXPECT_TRUE(has("of 19200 readings are listed"));
  EXPECT_TRUE(has("<summary>Rows 201 to 400</summary>"));
  EXPECT_TRUE(has("of 57600 points are drawn"));
  EXPECT_TRUE(has(">7778<td>")) << "the largest residual is listed";
  EXPECT_EQ(count_of(page, "data-reading="), 12U) << "the cube is turned to each seat once";
}

TEST(CalibrationReport, CooksContoursCountTheFitsParameters) {
  const auto contour = [](const Calibration& calibration) {
    for (const Plot& plot : residual_plots(calibration, nullptr)) {
      if (plot.id == "leverage") {
        return plot.series.back();
      }
    }
    return PlotSeries{};
  };
  Calibration calibration = calibrated();
  const double parameters = calibration.fit.statistics->leverage.sum() / 3.0;
  EXPECT_NEAR(parameters, 5.67, 0.1);  // 4 + block shift + 2/3 (direction)
  // The contour's distance by its definition, from studentised residual and leverage.
  for (const double more : {1.0, 2.0}) {
    calibration.fit.statistics->leverage *= more;
    const PlotSeries curve = contour(calibration);
    const double nu = calibration.fit.statistics->degrees_of_freedom.minCoeff();
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      if (std::isfinite(curve.y[i])) {
        const double t2 = curve.y[i] * curve.y[i];
        const double r2 = t2 * nu / (nu - 1.0 + t2);
        EXPECT_NEAR(r2 * curve.x[i] / ((1.0 - curve.x[i]) * parameters * more), 1.0, 1e-6);
      }
    }
  }
}

TEST(CalibrationReport, TextIsShownAsTyped) {
  const std::string hostile = "</script><img src=x onerror='alert(1)'>\"&";
  SensorModel truth = accelerometer_truth();
  truth.instrument.axes = {"<b>", "'", "\""};
  Calibration calibration = calibrate(experiment_for(truth), observe(truth, {.noise_sd = 1e-4}));
  calibration.sensor.instrument.serial = hostile;
  calibration.sensor.instrument.unit = hostile;
  calibration.provenance.software = hostile;
  calibration.provenance.created = hostile;
  calibration.provenance.positioner = hostile;
  calibration.findings.notes = {{NoteCode::other, hostile}};
  calibration.provenance.inputs = {{.path = hostile, .sha256 = hostile}};
  calibration.findings.warnings = {{.code = WarningCode::outlier, .runs = {1}, .message = hostile}};
  calibration.findings.status = CalibrationStatus::warning;
  const std::string page = calibration_report(calibration);
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, Not(HasSubstr("<b>")));
  EXPECT_THAT(page,
              HasSubstr("&lt;/script&gt;&lt;img src=x onerror=&#39;alert(1)&#39;&gt;&quot;&amp;"));
  // Text in the script's data cannot end the script element.
  const std::size_t data = page.find("id=\"report-data\">");
  if (data != std::string::npos) {
    EXPECT_THAT(page.substr(data, page.find("</script>", data) - data),
                HasSubstr("\\u003c/script>"));
  }
}

TEST(CalibrationReport, RefusedIsSaidAtTheTopWithTheLikeliestReason) {
  Calibration calibration = calibrated();
  calibration.findings.status = CalibrationStatus::refused;
  calibration.findings.warnings = {
      {.code = WarningCode::wrong_pose, .runs = {7}, .message = "run 7 may lie on +Y"}};
  calibration.findings.suggestion =
      Correction{.code = WarningCode::wrong_pose,
                 .message = "run 7 was taken on +Y",
                 .runs = {7},
                 .points = {{7, DesignPoint(Face::plus_y, Face::plus_x)}}};
  // The report is made of a record that was written and read.
  const std::string page =
      calibration_report(parse_calibration(calibration_json(calibration), "record"));
  const DesignPoint labelled = *calibration.fit.residuals[6].point;
  EXPECT_THAT(page, HasSubstr("As labelled: " + typographic_face(face_name(labelled.rest())) +
                              " on the table, " + typographic_face(face_name(labelled.fence())) +
                              " at the fence"));
  EXPECT_THAT(page, HasSubstr("As it probably lay: +Y on the table, +X at the fence"));
  const std::size_t verdict = page.find("class=\"verdict refused\"");
  ASSERT_NE(verdict, std::string::npos);
  EXPECT_LT(verdict, page.find("<section"));
  EXPECT_THAT(page, HasSubstr("Refused: do not use this calibration."));
  EXPECT_THAT(page, HasSubstr("Most likely: run 7 was taken on +Y"));
  EXPECT_THAT(page, Not(HasSubstr("from one reading is")));
  EXPECT_THAT(page, HasSubstr("class=\"suspect\">suspect"));
}

// If a confirmation fails, that is the verdict.
TEST(CalibrationReport, AConfirmationThatFailsIsTheVerdict) {
  Calibration calibration = calibrated();
  calibration.findings.confirmation = Confirmation{.p_value = 1e-9, .passed = false};
  const std::string page = calibration_report(calibration);
  EXPECT_THAT(page, HasSubstr("class=\"verdict refused\""));
  EXPECT_THAT(page, HasSubstr("the confirmation readings contradict the fit"));
  EXPECT_THAT(page, Not(HasSubstr("No problems found")));
}

// Without the readings the page calls nothing measured.
TEST(CalibrationReport, InventsNoReadings) {
  Calibration calibration = calibrated();
  EXPECT_THAT(calibration_report(calibration), HasSubstr("id=\"measured-plot\""));
  calibration.sensor.temperature =
      TemperatureResponse{.spans = {{.reference = 20.0, .low = 10.0, .high = 40.0}},
                          .bias = Eigen::MatrixXd::Constant(3, 1, 1e-3),
                          .scale = Eigen::MatrixXd::Constant(3, 1, 1e-4)};
  EXPECT_THAT(calibration_report(calibration), Not(HasSubstr("id=\"measured-plot\"")));
}

TEST(CalibrationReport, LimitsThatAreNotMetAreARefusal) {
  Calibration calibration = calibrated();
  calibration.findings.verdict =
      Verdict{.passed = false,
              .rule = "guarded",
              .limits = {{.parameter = "x.bias", .value = 0.2, .high = 0.1, .passed = false}}};
  const std::string page = calibration_report(calibration);
  EXPECT_THAT(page, HasSubstr("The unit does not meet its limits."));
  EXPECT_THAT(page, HasSubstr("<td>failed</td>"));
}

TEST(CalibrationReport, TakesARecordOfCoefficientsAlone) {
  Calibration bare;
  bare.sensor = accelerometer_truth();
  const std::string page = calibration_report(bare);
  EXPECT_THAT(page, HasSubstr("does not state uncertainties"));
  EXPECT_THAT(page, HasSubstr("z.sensitivity.y"));
  EXPECT_THAT(page, Not(HasSubstr("<section id=\"residuals\">")));
}

TEST(CalibrationReport, TemperatureAndHistoryHaveTheirPlots) {
  Calibration calibration = calibrated();
  calibration.sensor.temperature =
      TemperatureResponse{.spans = {{.reference = 20.0, .low = 10.0, .high = 40.0}},
                          .bias = Eigen::MatrixXd::Constant(3, 1, 1e-3),
                          .scale = Eigen::MatrixXd::Constant(3, 1, 1e-4)};
  UnitHistory history{.serial = calibration.sensor.instrument.serial,
                      .paths = {"a.json", "b.json"},
                      .dates = {"2025-01-01T00:00:00Z", "2026-01-01T00:00:00Z"}};
  history.trends.push_back({.parameter = "x.bias", .values = {0.1, 0.2}, .u = {0.01, 0.01}});
  const std::string page = calibration_report(calibration, {.history = {history}});
  EXPECT_THAT(page, HasSubstr("id=\"temperature-bias\""));
  EXPECT_THAT(page, HasSubstr("x, extrapolated"));
  EXPECT_THAT(page, HasSubstr("id=\"history-x\""));
  EXPECT_THAT(page, HasSubstr(">2026-01-01<"));
}

// A slope of 3 mrad along x over 0.2 m is 600 um, which is 1.2 turns at a pitch of 0.5 mm.
TEST(CalibrationReport, TurnsOfTheAdjusters) {
  Calibration calibration = calibrated();
  calibration.fit.levelness->mean_x = 3e-3;
  calibration.fit.levelness->mean_y = 0.0;
  calibration.fit.levelness->blocks.clear();
  Surface table{.adjusters_m = {{-0.1, 0.0}, {0.1, 0.1}, {0.1, -0.1}}, .thread_pitch_m = 0.5e-3};
  const std::string page = calibration_report(calibration, {.table = table});
  EXPECT_THAT(page, HasSubstr("To level the table"));
  EXPECT_THAT(page, HasSubstr(">600<"));
  EXPECT_THAT(page, HasSubstr(">1.2<"));
  calibration.fit.levelness->consistent = false;
  EXPECT_THAT(calibration_report(calibration, {.table = table}),
              Not(HasSubstr("To level the table")));
}

TEST(CalibrationReport, TurnsOfAGyroscope) {
  Calibration calibration = calibrated();
  calibration.fit.turn_errors_rad = {{1e-3, 0.0, -2e-3}, {0.0, 1e-3, 0.0}};
  const std::string text = calibration_json(calibration);
  const Calibration again = parse_calibration(text, "record");
  ASSERT_EQ(again.fit.turn_errors_rad.size(), 2U);
  EXPECT_EQ(calibration_json(again), text);
  const std::string page = calibration_report(again);
  EXPECT_THAT(page, HasSubstr("id=\"turns-plot\""));
  EXPECT_THAT(page, HasSubstr("data-value=\"-0.1145915590261646"));
}

TEST(CalibrationReport, NoiseHasItsAllanPlot) {
  LogNoise noise{.rate_hz = 100.0, .samples = 1000};
  ColumnNoise column{.name = "x"};
  for (const double tau : {0.01, 0.1, 1.0, 10.0}) {
    const double deviation = 1e-3 / std::sqrt(tau);
    column.curve.push_back(
        {.tau_s = tau, .deviation = deviation, .low = 0.9 * deviation, .high = 1.1 * deviation});
  }
  column.model = fit_noise(column.curve);
  column.dwell = {
      .best_s = 10.0, .deviation = 3e-4, .sensible_s = 8.0, .sensible_deviation = 3.2e-4};
  noise.columns.push_back(column);
  const std::string page = calibration_report(calibrated(), {.noise = &noise});
  EXPECT_THAT(page, HasSubstr("N [unit/sqrt(Hz)]"));
  EXPECT_THAT(noise_report(noise, "folder/rest.csv"),
              HasSubstr("<title>Noise of rest.csv</title>"));
  // The ticks of both axes are powers of ten at equal distances.
  const std::size_t figure = page.find("id=\"allan-1\"");
  const auto tick = [&](const std::string& text) {
    const std::size_t at = page.find(">" + text + "</text>", figure);
    EXPECT_NE(at, std::string::npos) << text;
    const std::size_t x = page.rfind(" x=\"", at) + 4;
    return std::stod(page.substr(x, 8));
  };
  EXPECT_NEAR(tick("1") - tick("0.1"), tick("10") - tick("1"), 0.2);
}

// With exact coefficients and noise s the uncertainty of the pitch is s / (F cos(pitch)), and so is
// that of the roll. At 80 degrees it is 5.76 s.
TEST(WorstAngleUncertainty, IsThatOfTheNoiseWhereTheCoefficientsAreExact) {
  Calibration calibration = calibrated();
  calibration.sensor.response.bias.setZero();
  calibration.sensor.response.sensitivity = Eigen::Matrix3d::Identity();
  calibration.fit.statistics->covariance.setZero();
  calibration.fit.statistics->components.clear();
  calibration.fit.conditions = {};
  calibration.fit.statistics->residual_sd.setConstant(1e-4);
  calibration.fit.uncertainty.reset();
  const double k = calibration.fit.statistics->coverage_factor.maxCoeff();
  const WorstAngleUncertainty worst = worst_angle_uncertainty(calibration);
  const double expected = k * 1e-4 / std::cos(80.0 * rad_per_deg) * deg_per_rad;
  // Roll depends on two axes, so it has more degrees of freedom and a smaller factor.
  EXPECT_GT(worst.expanded_deg, 0.85 * expected);
  EXPECT_LT(worst.expanded_deg, 1.02 * expected);
}

}  // namespace
}  // namespace axiscal::test
