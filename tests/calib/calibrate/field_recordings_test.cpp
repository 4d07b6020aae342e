// SPDX-License-Identifier: Apache-2.0
// Published recordings of magnetometers, accelerometers, light sensors and gyroscopes, with their
// published results.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <nlohmann/json.hpp>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/companion.hpp"
#include "axiscal/calib/least_squares.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "data.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

// Reads rows of numbers, separated by commas, tabs or spaces. Skips lines that begin with a letter.
Eigen::MatrixXd read_rows(const std::string& path, Eigen::Index columns) {
  std::ifstream file(path);
  std::vector<double> numbers;
  for (std::string line; std::getline(file, line);) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ',' || c == '\t' || c == '\r'; }, ' ');
    std::istringstream cells(line);
    std::vector<double> row;
    for (double value = 0.0; cells >> value;) {
      row.push_back(value);
    }
    if (static_cast<Eigen::Index>(row.size()) >= columns) {
      numbers.insert(numbers.end(), row.begin(), row.begin() + columns);
    }
  }
  return Eigen::Map<Eigen::MatrixXd>(numbers.data(), columns,
                                     static_cast<Eigen::Index>(numbers.size()) / columns)
      .transpose();
}

Observations observations_of(const Eigen::MatrixXd& response) {
  Observations observations;
  observations.response = response;
  for (Eigen::Index i = 0; i < response.rows(); ++i) {
    observations.readings.push_back({.run = static_cast<int>(i) + 1});
  }
  return observations;
}

Experiment experiment_of(const std::string& instrument, const std::string& field, double F) {
  Experiment experiment;
  experiment.instrument.kind = instrument;
  experiment.field.of = make_field(field);
  experiment.field.magnitude = F;
  return experiment;
}

// @return the root mean square of |A (v - b)| / F - 1.
double relative_rms(const Eigen::MatrixXd& v,
                    const Eigen::Matrix3d& A,
                    const Eigen::Vector3d& b,
                    double F) {
  const Eigen::ArrayXd lengths = ((v.rowwise() - b.transpose()) * A.transpose()).rowwise().norm();
  return std::sqrt((lengths / F - 1.0).square().mean());
}

// @return the root mean square of (|f| - F) / noise. Method magnitude minimises this sum, sum w
// (|f| - F)^2.
double weighted_rms(const Eigen::MatrixXd& v,
                    const Eigen::Matrix3d& A,
                    const Eigen::Vector3d& b,
                    double F) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    const Eigen::Vector3d f = A * (v.row(i).transpose() - b);
    sum += std::pow((f.norm() - F) / (A.transpose() * f.normalized()).norm(), 2);
  }
  return std::sqrt(sum / static_cast<double>(v.rows()));
}

Eigen::Matrix3d symmetric(double xx, double xy, double xz, double yy, double yz, double zz) {
  return (Eigen::Matrix3d() << xx, xy, xz, xy, yy, yz, xz, yz, zz).finished();
}

struct Published {
  Eigen::Matrix3d A;
  Eigen::Vector3d b;
};

// Expects that the fit of method magnitude is at least as good as the published one, and near it.
Calibration expect_as_good(const Eigen::MatrixXd& v,
                           const Experiment& experiment,
                           const Published& published,
                           double near) {
  const Calibration result = calibrate(experiment, observations_of(v));
  EXPECT_EQ(result.fit.method, Method::magnitude);
  const double F = result.sensor.field.magnitude;
  const Eigen::Matrix3d A = Eigen::Matrix3d(result.sensor.response.sensitivity).inverse();
  EXPECT_LE(weighted_rms(v, A, result.sensor.response.bias, F),
            weighted_rms(v, published.A, published.b, F));
  EXPECT_LE(relative_rms(v, A, result.sensor.response.bias, F),
            1.001 * relative_rms(v, published.A, published.b, F));
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.sensor.response.bias(i), published.b(i),
                near * result.fit.statistics->bias_se(i));
  }
  EXPECT_LT((A - published.A).cwiseAbs().maxCoeff() / published.A.norm(), 0.01);
  EXPECT_NEAR(result.fit.orientations->fit_error,
              relative_rms(v, A, result.sensor.response.bias, F), 1e-12);
  return result;
}

TEST(Lsm9ds1, MagnetometerIsAsMagnetoSays) {
  AXISCAL_NEED_DATA(path, "mag_acc_lsm9ds1_magneto/cal_m.csv");
  const Eigen::MatrixXd v = read_rows(path, 3);
  ASSERT_EQ(v.rows(), 301);
  const Published published{.A = symmetric(1.04492, 0.03452, -0.01714, 1.05168, 0.00644, 1.07005),
                            .b = {-922.31, 2199.41, 373.17}};
  const Calibration result =
      expect_as_good(v, experiment_of("magnetometer", "geomagnetic", 3746.0), published, 1.0);
  EXPECT_LE(relative_rms(v, Eigen::Matrix3d(result.sensor.response.sensitivity).inverse(),
                         result.sensor.response.bias, 3746.0),
            relative_rms(v, published.A, published.b, 3746.0));
}

TEST(Lsm9ds1, AccelerometerTurnedByHandIsAsMagnetoSaysByRobustRegression) {
  AXISCAL_NEED_DATA(path, "mag_acc_lsm9ds1_magneto/cal_a.csv");
  const Eigen::MatrixXd v = read_rows(path, 3);
  // Magneto's author removed readings during motion by hand. The bisquare regression gives them
  // small weights.
  Experiment experiment = experiment_of("accelerometer", "gravity", 1.0);
  experiment.fit.robust = true;
  const Calibration result = calibrate(experiment, observations_of(v));
  const Eigen::Vector3d published(-133.33, 72.29, -291.92);
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.sensor.response.bias(i), published(i), 100.0);  // 0.6 % of g
    EXPECT_NEAR(result.sensor.response.sensitivity(i, i), 16457.0, 330.0);
  }
  Experiment plain = experiment;
  plain.fit.robust = false;
  const Eigen::Vector3d by_all = calibrate(plain, observations_of(v)).sensor.response.bias;
  EXPECT_LT((result.sensor.response.bias - published).norm(), (by_all - published).norm());
}

TEST(Mag3, IsAsTheirCalibrate3Says) {
  AXISCAL_NEED_DATA(path, "mag_mag3_magneto/mag3_raw.csv");
  const Published published{
      .A = symmetric(0.25060005, 0.02941951, -0.02954944, 0.31691521, 0.00788726, 0.30592214),
      .b = {9955.151669, -7948.26463057, 8511.80447932}};
  static_cast<void>(expect_as_good(
      read_rows(path, 3), experiment_of("magnetometer", "geomagnetic", 1000.0), published, 2.0));
}

TEST(Px4, OffsetAndScaleAreThoseOfTheirUnitTest) {
  AXISCAL_NEED_DATA(path, "mag_px4_commander/mag_data1.csv");
  const Eigen::MatrixXd v = read_rows(path, 3);
  Experiment experiment = experiment_of("magnetometer", "geomagnetic", 0.36243056);
  experiment.field.unit = "G";
  const Calibration result = calibrate(experiment, observations_of(v));
  const Eigen::Vector3d offset(-0.18, 0.05, -0.58);
  const Eigen::Vector3d scale(1.0, 1.06, 0.94);
  const Eigen::Matrix3d A = Eigen::Matrix3d(result.sensor.response.sensitivity).inverse();
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.sensor.response.bias(i), offset(i), 0.01);
    EXPECT_NEAR(A(i, i), scale(i), 0.011);
  }
  // SOURCE.md: the residual of the diagonal ellipsoid is 0.011958 G, that of nine parameters
  // 0.011260 G.
  EXPECT_LT(result.fit.orientations->fit_error * 0.36243056, 0.011270);
}

TEST(Qmc5883l, IsNoWorseThanTheirAffineFit) {
  AXISCAL_NEED_DATA(path, "mag_qmc5883l_uncuyo/filtered_raw_data.csv");
  const Eigen::MatrixXd v = read_rows(path, 3);
  ASSERT_EQ(v.rows(), 22745);
  Eigen::Matrix3d A;
  A << 9.23963302e-04, -2.28276038e-05, -1.26491570e-05, -3.26463689e-05, 1.39419601e-03,
      -8.31640876e-05, 9.24662679e-07, 5.04342440e-05, 6.25530654e-04;
  const Eigen::Vector3d b = -A.inverse() * Eigen::Vector3d(-5.6742573, 0.1399525, -2.19375634);
  const Calibration result =
      calibrate(experiment_of("magnetometer", "geomagnetic", 1.0), observations_of(v));
  EXPECT_LE(result.fit.orientations->fit_error, relative_rms(v, A, b, 1.0));
  EXPECT_LT((result.sensor.response.bias - b).norm(), 20.0);
}

TEST(Wrona, ResidualIsNotAboveMagnetos) {
  AXISCAL_NEED_DATA(path, "accel_static_wrona_magneto/acceldata-example.txt");
  const Eigen::MatrixXd v = read_rows(path, 3);
  ASSERT_EQ(v.rows(), 178);
  const Published published{
      .A = symmetric(1.004332, 0.000046, 0.004896, 0.969793, 0.009452, 1.022384),
      .b = {0.027031, -0.040204, 0.046558}};
  const Calibration result =
      expect_as_good(v, experiment_of("accelerometer", "gravity", 1.0), published, 1.0);
  EXPECT_LE(result.fit.orientations->fit_error, relative_rms(v, published.A, published.b, 1.0));
}

TEST(CkAccelerometer, IsAsLiAndGriffithsFit) {
  AXISCAL_NEED_DATA(path, "accel_static_ck/acc_log.csv");
  const Eigen::MatrixXd v = read_rows(path, 3);
  const Published published{
      .A = symmetric(1.0023092, 0.00015388528, -0.0014443558, 1.0033263, 0.00024830041, 1.0022666),
      .b = {-0.020476569, 0.0085171798, 0.015322696}};
  static_cast<void>(
      expect_as_good(v, experiment_of("accelerometer", "gravity", 1.0), published, 3.0));
}

// ---- cave survey instruments: magnetometer and accelerometer in 24 attitudes ----

struct Survey {
  Eigen::MatrixXd mag;
  Eigen::MatrixXd grav;
  bool good_accelerometer = true;
  bool points_well = true;
};

Survey read_survey(const std::string& path) {
  std::string text = test::read_file(path);
  for (std::size_t at = text.find("NaN"); at != std::string::npos; at = text.find("NaN", at)) {
    text.replace(at, 3, "0.0");  // values at the end that are not used
  }
  const nlohmann::json json = nlohmann::json::parse(text);
  Survey survey;
  if (json.contains("shots")) {
    const auto rows_of = [](const nlohmann::json& flat) {
      Eigen::MatrixXd rows(24, 3);
      for (int i = 0; i < 72; ++i) {
        rows(i / 3, i % 3) = flat.at(static_cast<std::size_t>(i)).get<double>();
      }
      return rows;
    };
    survey.mag = rows_of(json.at("shots").at("mag"));
    survey.grav = rows_of(json.at("shots").at("grav"));
    return survey;
  }
  const auto rows_of = [](const nlohmann::json& list, const Eigen::Matrix3d& axes) {
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(list.size()), 3);
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Eigen::Vector3d v(list[i][0], list[i][1], list[i][2]);
      rows.row(static_cast<Eigen::Index>(i)) = (axes * v).transpose();
    }
    return rows;
  };
  survey.mag = rows_of(json.at("mag"), Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal());
  survey.grav =
      rows_of(json.at("grav"), (Eigen::Matrix3d() << 0, -1, 0, -1, 0, 0, 0, 0, 1).finished());
  survey.good_accelerometer = false;  // SOURCE.md: not linear to 0.001
  return survey;
}

// @return the axis about which the instrument was rolled. The field's component along it is
// constant.
Eigen::Vector3d roll_axis(const Eigen::MatrixXd& fields) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const int first : {8, 16}) {
    const Eigen::MatrixXd ring = fields.middleRows(first, 8);
    const Eigen::MatrixXd centred = ring.rowwise() - ring.colwise().mean();
    scatter += centred.transpose() * centred;
  }
  const Eigen::Vector3d axis =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  return axis.y() < 0.0 ? Eigen::Vector3d(-axis) : axis;
}

// @return the largest scatter [deg] of the direction of `axis` within the two rings, by gravity and
// the geomagnetic field. In each ring the axis points to one target.
double pointing_spread_deg(const Eigen::MatrixXd& mag,
                           const Eigen::MatrixXd& grav,
                           const Eigen::Vector3d& axis) {
  double worst = 0.0;
  for (const int first : {8, 16}) {
    Eigen::MatrixXd directions(8, 3);
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d up = grav.row(first + i).normalized();
      const Eigen::Vector3d m = mag.row(first + i);
      const Eigen::Vector3d east = m.cross(up).normalized();
      const Eigen::Vector3d north = up.cross(east);
      directions.row(i) << axis.dot(east), axis.dot(north), axis.dot(up);
    }
    const Eigen::RowVector3d mean = directions.colwise().mean();
    const double spread =
        std::sqrt((directions.rowwise() - mean).rowwise().squaredNorm().mean()) * deg_per_rad;
    worst = std::max(worst, spread);
  }
  return worst;
}

class SurveyDevice : public testing::TestWithParam<const char*> {};

TEST_P(SurveyDevice, IsUniformAndAlignsOnItsTwoRings) {
  AXISCAL_NEED_DATA(path, "survey_mag_grav_24pos/" + std::string(GetParam()) + ".json");
  Survey survey = read_survey(path);
  const std::set<std::string> rolled_badly = {"SAP6_BB", "SAP6_CF", "SAP6_FG", "cal_data_ab",
                                              "cal_data_bh"};
  survey.points_well = !rolled_badly.contains(GetParam());
  Experiment experiment = experiment_of("magnetometer", "geomagnetic", 1.0);
  Calibration mag = calibrate(experiment, observations_of(survey.mag));
  const Calibration grav =
      calibrate(experiment_of("accelerometer", "gravity", 1.0), observations_of(survey.grav));
  // The limits of the publication: rms(|f| - 1) below 0.01 and 0.001.
  EXPECT_LT(mag.fit.orientations->fit_error, 0.01);
  EXPECT_LT(grav.fit.orientations->fit_error, survey.good_accelerometer ? 0.001 : 0.005);

  const auto fields = [](const Calibration& calibration, const Eigen::MatrixXd& v) {
    return Eigen::MatrixXd(
        (v.rowwise() - calibration.sensor.response.bias.transpose()) *
        Eigen::Matrix3d(calibration.sensor.response.sensitivity).inverse().transpose());
  };
  const Eigen::MatrixXd up = fields(grav, survey.grav);
  const double before = pointing_spread_deg(fields(mag, survey.mag), up, Eigen::Vector3d::UnitY());
  // The rolling axis of both instruments is the same axis of the housing.
  const Eigen::MatrixXd unaligned = fields(mag, survey.mag);
  const Eigen::Matrix3d by_rings = smallest_rotation(roll_axis(unaligned), roll_axis(up));
  const double after = pointing_spread_deg(unaligned * by_rings.transpose(), up, roll_axis(up));
  // The publication's limit is 0.5 degrees and half of the spread before. Here the spread is that
  // of all three components in the worse ring. For five devices it is 0.6 to 2 degrees by any
  // alignment, because they were not rolled precisely or their accelerometer is not linear.
  EXPECT_LT(after, survey.points_well ? 0.5 : 2.0);
  EXPECT_LT(after, survey.points_well ? 0.5 * before : before);
  // The alignment by the constant angle does not use the rings. It finds the same axis within its
  // uncertainty.
  align_with_companion(mag, observations_of(survey.mag), grav, observations_of(survey.grav),
                       "grav.json");
  const Alignment& alignment = mag.fit.alignment->alignment;
  const Eigen::Vector3d axis = roll_axis(fields(mag, survey.mag));
  const double between_rad = std::acos(std::min(1.0, axis.dot(roll_axis(up))));
  EXPECT_LT(between_rad, 3.0 * alignment.standard_error_rad.norm());
  EXPECT_LT(alignment.standard_error_rad.norm(), 0.4 * rad_per_deg);
  RecordProperty("spread_before_deg", std::to_string(before));
  RecordProperty("spread_after_deg", std::to_string(after));
  EXPECT_NEAR(fields(mag, survey.mag).row(0).norm(), unaligned.row(0).norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Devices,
                         SurveyDevice,
                         testing::Values("SAP6_BB",
                                         "SAP6_CF",
                                         "SAP6_FG",
                                         "SAP6_HC",
                                         "cal_data_ab",
                                         "cal_data_ai",
                                         "cal_data_bh",
                                         "cal_data_bi",
                                         "cal_data_ee",
                                         "cal_data_fb"),
                         [](const auto& device) { return std::string(device.param); });

// ---- light ----

TEST(SunSensor, PlaneIsTheirsAndThreeComponentsFitNoWorse) {
  AXISCAL_NEED_DATA(path, "sun_sensor_stand/sun_sensor_stand.csv");
  const Eigen::MatrixXd rows = read_rows(path, 4);
  ASSERT_EQ(rows.rows(), 252);
  const Eigen::ArrayXd polar = rows.col(0).array() * rad_per_deg;
  const Eigen::ArrayXd azimuth = rows.col(1).array() * rad_per_deg;
  Eigen::MatrixXd X(rows.rows(), 3);
  X << Eigen::VectorXd::Ones(rows.rows()), (polar.sin() * azimuth.cos()).matrix(),
      (polar.sin() * azimuth.sin()).matrix();
  const LeastSquaresDesign plane(X);
  const LeastSquaresFit x = plane.fit(rows.col(2));
  const LeastSquaresFit y = plane.fit(rows.col(3));
  EXPECT_MATRIX_NEAR(x.estimate, Eigen::Vector3d(-0.049138, 0.326613, -0.053172), 1e-6);
  EXPECT_MATRIX_NEAR(y.estimate, Eigen::Vector3d(0.050561, -0.056544, -0.326541), 1e-6);

  Experiment experiment = experiment_of("optical", "light", 1.0);
  experiment.instrument.axes = {"spot_x", "spot_y"};
  Observations observations = observations_of(rows.rightCols(2));
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    observations.readings[i].field_in_sensor =
        Eigen::Vector3d(X(at, 1), X(at, 2), std::cos(polar(at)));
  }
  const Calibration result = calibrate(experiment, observations);
  EXPECT_EQ(result.fit.method, Method::known);
  const auto rms = [&](Eigen::Index k) {
    double sum = 0.0;
    for (const ReadingResidual& residual : result.fit.residuals) {
      sum += residual.response(k) * residual.response(k);
    }
    return std::sqrt(sum);
  };
  EXPECT_LE(rms(0), x.residuals.norm());
  EXPECT_LE(rms(1), y.residuals.norm());
}

// The voltage of the monitor diode is the light. The photodiode saturates at about 2 ADU.
class Photodiode : public testing::TestWithParam<std::pair<const char*, std::array<double, 3>>> {};

TEST_P(Photodiode, IsALineBelowSaturation) {
  const auto& [name, expected] = GetParam();
  AXISCAL_NEED_DATA(path, "photodiode_responsivity/" + std::string(name));
  std::ifstream file(path);
  std::vector<double> voltage;
  std::vector<double> reading;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, '\t');) {
      cells.push_back(cell);
    }
    if (cells.size() > 8 && std::stod(cells[2]) > 0.2) {  // above the laser's threshold
      voltage.push_back(std::stod(cells[6]));
      reading.push_back(std::stod(cells[8]));
    }
  }
  ASSERT_EQ(voltage.size(), 72U);
  Experiment experiment = experiment_of("optical", "light", 1.0);
  experiment.instrument.axes = {"adu"};
  const double largest = *std::max_element(reading.begin(), reading.end());
  experiment.instrument.range = ReadingRange{.low = -1.0, .high = 0.9 * largest};
  // A regression of the readings on the light, without saturated readings, gives slope and bias.
  std::vector<double> x;
  std::vector<double> y;
  for (std::size_t i = 0; i < voltage.size(); ++i) {
    if (reading[i] < experiment.instrument.range->high) {
      x.push_back(voltage[i]);
      y.push_back(reading[i]);
    }
  }
  EXPECT_EQ(x.size(), 61U);
  Eigen::MatrixXd X(static_cast<Eigen::Index>(x.size()), 2);
  X << Eigen::VectorXd::Ones(X.rows()), Eigen::Map<Eigen::VectorXd>(x.data(), X.rows());
  const LeastSquaresFit line_fit =
      LeastSquaresDesign(X).fit(Eigen::Map<Eigen::VectorXd>(y.data(), X.rows()));
  EXPECT_NEAR(line_fit.estimate(1), expected[0], 6e-6 * expected[0]);
  EXPECT_NEAR(line_fit.estimate(0), expected[1], 6e-6);

  // Method known with --range gives the same slope. Two added readings across the light make all
  // three sensitivities determined.
  Observations observations = observations_of(Eigen::MatrixXd(voltage.size() + 2, 1));
  for (std::size_t i = 0; i < voltage.size() + 2; ++i) {
    const bool real = i < voltage.size();
    const Eigen::Vector3d across =
        i == voltage.size() ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    observations.readings[i].field_in_sensor =
        real ? Eigen::Vector3d(0.0, 0.0, voltage[i]) : across;
    observations.response(static_cast<Eigen::Index>(i), 0) =
        real ? reading[i] : line_fit.estimate(0);
  }
  const Calibration result = calibrate(experiment, observations);
  EXPECT_NEAR(result.sensor.response.sensitivity(0, 2), expected[0], 6e-6 * expected[0]);
  EXPECT_EQ(result.fit.statistics->observations_per_axis.front(), 63);
}

INSTANTIATE_TEST_SUITE_P(Filters,
                         Photodiode,
                         testing::Values(std::pair("PD_Responsivity_G2_1_1_0.txt",
                                                   std::array{29.72237, -0.00269, 0.0063}),
                                         std::pair("PD_Responsivity_G2_1_1_4.txt",
                                                   std::array{29.99200, -0.00354, 0.0048})));

// ---- Ferraris: six rests and three turns ----

TEST(Ferraris, AccelerometerAndGyroscopeAreAsImucalSays) {
  AXISCAL_NEED_DATA(path, "imu_ferraris_imucal/annotated_session.csv");
  AXISCAL_NEED_DATA(published_path, "imu_ferraris_imucal/example_cal.json");
  const nlohmann::json published = test::read_json(published_path);
  const auto matrix = [&](const char* name) {
    Eigen::Matrix3d M;
    for (int i = 0; i < 9; ++i) {
      M(i / 3, i % 3) =
          published.at(name)[static_cast<std::size_t>(i / 3)][static_cast<std::size_t>(i % 3)];
    }
    return M;
  };
  struct Part {
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    double count = 0.0;
  };
  std::map<std::string, Part> parts;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream cells(line);
    std::string name;
    double number = 0.0;
    cells >> name >> number;
    Part& part = parts[name];
    for (int j = 0; j < 6; ++j) {
      cells >> number;
      part.sum(j) += number;
    }
    part.count += 1.0;
  }
  ASSERT_EQ(parts.size(), 9U);
  // Accelerometer: method known by six rests.
  constexpr double g = 9.81;
  Eigen::MatrixXd response(6, 3);
  std::vector<Eigen::Vector3d> fields;
  Eigen::MatrixXd gyro(9, 3);
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(9, 7);  // 1, rate, specific force
  X.col(0).setOnes();
  const char* names[] = {"x_p", "x_a", "y_p", "y_a", "z_p", "z_a", "x_rot", "y_rot", "z_rot"};
  for (int i = 0; i < 9; ++i) {
    const Part& part = parts.at(names[i]);
    gyro.row(i) = part.sum.tail<3>() / part.count;
    if (i < 6) {
      response.row(i) = part.sum.head<3>() / part.count;
      fields.emplace_back((i % 2 == 0 ? g : -g) * Eigen::Vector3d::Unit(i / 2));
    }
  }
  Observations observations = observations_of(response);
  for (std::size_t i = 0; i < 6; ++i) {
    observations.readings[i].field_in_sensor = fields[i];
  }
  Experiment experiment = experiment_of("accelerometer", "gravity", g);
  experiment.field.unit = "m/s^2";
  const Calibration acc = calibrate(experiment, observations);
  // Ferraris' K R is S here. Each of his biases is from the two rests along the axis, ours is from
  // all six rests.
  const Eigen::Matrix3d KR = matrix("K_a") * matrix("R_a");
  EXPECT_MATRIX_NEAR(acc.sensor.response.sensitivity, KR, 1e-10 * KR.norm());
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double b = published.at("b_a")[static_cast<std::size_t>(k)];
    EXPECT_NEAR(acc.sensor.response.bias(k), b, 0.02 * g * KR(k, k));
  }

  // Gyroscope: bias, scale and g-sensitivity by one regression. Each turn is -360 degrees; the rate
  // of samples is 204.8 Hz.
  const Eigen::Matrix3d inverse = Eigen::Matrix3d(acc.sensor.response.sensitivity).inverse();
  for (int i = 0; i < 9; ++i) {
    const Part& part = parts.at(names[i]);
    const Eigen::Vector3d force =
        inverse * (part.sum.head<3>() / part.count - acc.sensor.response.bias);
    X.row(i).tail<3>() = i < 6 ? fields[static_cast<std::size_t>(i)] : force;
    if (i >= 6) {
      X(i, 1 + i - 6) = -360.0 * 204.8 / part.count;
    }
  }
  const LeastSquaresDesign design(X);
  const Eigen::Matrix3d scale = matrix("K_g") * matrix("R_g");
  const Eigen::Matrix3d g_sensitivity = matrix("K_ga");
  for (Eigen::Index k = 0; k < 3; ++k) {
    const LeastSquaresFit fit = design.fit(gyro.col(k));
    // The tolerance is the difference between the two definitions of the bias.
    EXPECT_MATRIX_NEAR(fit.estimate.segment<3>(1), scale.row(k).transpose(), 0.02);
    EXPECT_MATRIX_NEAR(fit.estimate.tail<3>(), g_sensitivity.row(k).transpose(), 1e-9);
    EXPECT_NEAR(fit.estimate(0), published.at("b_g")[static_cast<std::size_t>(k)], 0.2);
  }
}

}  // namespace
}  // namespace axiscal
