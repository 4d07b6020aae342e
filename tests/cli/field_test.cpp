// SPDX-License-Identifier: Apache-2.0
// Fields and instruments by the command.
#include <cmath>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/observations_csv.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::csv_cells;
using test::ProgramResult;
using test::read_file;
using test::read_json;
using test::run_axiscal;
using test::ScratchFolder;
using testing::HasSubstr;

TEST(FieldCommand, PrintsAllFieldsOfASite) {
  const std::vector<std::string> munich = {"field",       "--latitude", "48.14",
                                           "--longitude", "11.58",      "--height",
                                           "520",         "--date",     "2026-06-21T11:00Z"};
  const ProgramResult table = run_axiscal(munich);
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("wmm2025"));
  EXPECT_THAT(table.out, HasSubstr("138 nT"));
  std::vector<std::string> as_json = munich;
  as_json.emplace_back("--json");
  const auto printed = nlohmann::json::parse(run_axiscal(as_json).out);
  EXPECT_NEAR(printed["gravity"]["magnitude"].get<double>(), 9.8074, 1e-4);
  EXPECT_EQ(printed["gravity"]["unit"], "m/s^2");
  EXPECT_EQ(printed["gravity"]["model"], "wgs84");
  EXPECT_NEAR(printed["geomagnetic"]["inclination_deg"].get<double>(), 64.4, 0.1);
  EXPECT_NEAR(printed["earth_rotation"]["enu"][2].get<double>(),
              7.292115e-5 * std::sin(48.14 * rad_per_deg), 1e-12);
  EXPECT_NEAR(printed["sun"]["elevation_deg"].get<double>(), 65.3, 0.3);  // midsummer, about noon
  as_json.insert(as_json.end(), {"--only", "gravity,sun"});
  const auto some = nlohmann::json::parse(run_axiscal(as_json).out);
  EXPECT_EQ(some.size(), 2U);
}

TEST(CalibrateCommand, NeedsTheLongitudeOfAMagneticSite) {
  const ScratchFolder folder;
  const std::string run =
      folder.write("run.csv", test::observations_text(test::accelerometer_truth(), {}));
  EXPECT_EQ(
      run_axiscal({"calibrate", run, "--instrument", "magnetometer", "--field",
                   "induced_magnetic+geomagnetic", "--field-magnitude", "5", "--latitude", "48"})
          .status,
      2);
  const std::string experiment = folder.write("e.json", R"({"format":"axiscal-experiment",
    "version":1,"observations":"run.csv","instrument":{"kind":"magnetometer"},
    "field":{"kind":"geomagnetic"},"site":{"latitude_deg":48}})");
  const ProgramResult result = run_axiscal({"calibrate", experiment});
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.err, HasSubstr("longitude"));
}

TEST(FieldCommand, RefusesWhatNoModelHoldsFor) {
  const std::vector<std::string> past = {"field", "--latitude", "10",        "--longitude",
                                         "20",    "--date",     "2001-01-01"};
  EXPECT_EQ(run_axiscal(past).status, 1);
  EXPECT_THAT(run_axiscal(past).err, HasSubstr("from 2025 to 2030"));
  std::vector<std::string> without = past;
  without.insert(without.end(), {"--only", "gravity,earth_rotation,sun"});
  EXPECT_EQ(run_axiscal(without).status, 0);
  EXPECT_EQ(run_axiscal({"field", "--latitude", "10"}).status, 2);
  EXPECT_EQ(run_axiscal({"field"}).status, 2);
  EXPECT_EQ(run_axiscal({"field", "--latitude", "10", "--longitude", "2", "--only", "moon"}).status,
            2);
  const ProgramResult missing = run_axiscal(
      {"field", "--latitude", "10", "--longitude", "2", "--magnetic-model", "no-such-model"});
  EXPECT_EQ(missing.status, 3);
  EXPECT_THAT(missing.err, HasSubstr("not found in the folder"));
}

// A log of a magnetometer (mx, my, mz) and an accelerometer (ax, ay, az) in one housing that is
// turned by hand.
struct HandTurned {
  Eigen::Matrix3d soft_iron;
  Eigen::Vector3d hard_iron{30.0, -12.0, 8.0};
  std::string log;
  std::vector<Eigen::Matrix3d> attitudes;  // rotation_sensor_from_enu
};

HandTurned hand_turned() {
  HandTurned made;
  made.soft_iron =
      (Eigen::Matrix3d() << 1.1, 0.05, -0.03, 0.05, 0.95, 0.02, -0.03, 0.02, 1.02).finished();
  made.log = "mx,my,mz,ax,ay,az\n";
  RandomStream random(5, 0);
  constexpr double dip_rad = 60.0 * rad_per_deg;
  const Eigen::Vector3d field = 48.0 * Eigen::Vector3d(0.0, std::cos(dip_rad), -std::sin(dip_rad));
  for (const Eigen::Vector3d& direction : directions_on_sphere(80)) {
    const Eigen::Vector3d turn = 3.0 * direction + 0.3 * random.normals<3>();
    const Eigen::Matrix3d R = rotation_by(turn);
    made.attitudes.push_back(R);
    const Eigen::Vector3d m = made.hard_iron + made.soft_iron * (R * field);
    const Eigen::Vector3d a = R * Eigen::Vector3d::UnitZ();
    for (int i = 0; i < 6; ++i) {
      const double value =
          (i < 3 ? m(i) + 0.02 * random.normal() : a(i - 3) + 1e-4 * random.normal());
      made.log += number_text(value) + (i < 5 ? "," : "\n");
    }
  }
  return made;
}

TEST(MagnitudeMethod, GivesATiltCompensatedCompass) {
  const ScratchFolder folder;
  const HandTurned made = hand_turned();
  const std::string log = folder.write("log.csv", made.log);
  const std::string acc = folder.path("acc.json");
  const std::string mag = folder.path("mag.json");
  ASSERT_EQ(run_axiscal({"calibrate", log, "--instrument", "accelerometer", "--axes", "ax,ay,az",
                         "--field", "gravity", "-o", acc})
                .status,
            0);
  const ProgramResult result =
      run_axiscal({"calibrate", log, "--instrument", "magnetometer", "--axes", "mx,my,mz", "--unit",
                   "uT", "--field", "geomagnetic", "--field-unit", "uT", "--field-magnitude", "48",
                   "--align", acc, "-o", mag});
  ASSERT_EQ(result.status, 0) << result.err;
  // A pipe, which can be read only once, gives the same result.
  const ProgramResult piped = run_axiscal(
      {"calibrate", "-", "--instrument", "magnetometer", "--axes", "mx,my,mz", "--unit", "uT",
       "--field", "geomagnetic", "--field-unit", "uT", "--field-magnitude", "48", "--align", acc},
      {.stdin_text = made.log});
  EXPECT_EQ(piped.status, 0) << piped.err;
  EXPECT_THAT(piped.out, HasSubstr("aligned with"));
  EXPECT_THAT(result.out, HasSubstr("hard iron"));
  EXPECT_THAT(result.out, HasSubstr("aligned with"));
  const auto record = read_json(mag);
  EXPECT_EQ(record["method"], "magnitude");
  EXPECT_TRUE(record["field"]["in_table"].is_null());
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(record["coefficients"]["bias"][k].get<double>(),
                made.hard_iron(static_cast<Eigen::Index>(k)), 0.05);
  }
  EXPECT_NEAR(record["alignment"]["angle_rad"].get<double>(), 150.0 * rad_per_deg, 1e-3);
  EXPECT_EQ(calibration_json(read_calibration(mag)), read_file(mag));

  const ProgramResult reduced =
      run_axiscal({"apply", mag, log, "--attitude", acc, "--declination", "4", "-o", "-"});
  ASSERT_EQ(reduced.status, 0) << reduced.err;
  const auto rows = csv_cells(reduced.out);
  EXPECT_EQ(rows[0][10], "heading_deg");
  EXPECT_EQ(rows[0][11], "dip_deg");
  int compared = 0;
  for (std::size_t i = 0; i < made.attitudes.size(); ++i) {
    // The direction of the x axis in enu. Nearly vertical directions are skipped.
    const Eigen::Vector3d forward = made.attitudes[i].transpose() * Eigen::Vector3d::UnitX();
    if (std::abs(forward.z()) > 0.9) {
      continue;
    }
    const double heading = std::atan2(forward.x(), forward.y()) * deg_per_rad + 4.0;
    const double difference = std::remainder(std::stod(rows[i + 1][10]) - heading, 360.0);
    EXPECT_NEAR(difference, 0.0, 0.5);
    EXPECT_NEAR(std::stod(rows[i + 1][11]), 60.0, 0.3);
    ++compared;
  }
  EXPECT_GT(compared, 40);
  // Without an accelerometer there is no heading.
  const std::string header = read_file(log).substr(0, 10);
  EXPECT_THAT(run_axiscal({"apply", mag, log}).out, testing::Not(HasSubstr("heading")));
  EXPECT_EQ(run_axiscal({"apply", mag, log, "--declination", "3"}).status, 2);
  EXPECT_EQ(run_axiscal({"apply", mag, log, "--attitude", mag}).status, 3);
  const std::string before = read_file(acc);
  EXPECT_EQ(run_axiscal({"apply", mag, log, "--attitude", acc, "-o", acc}).status, 2);
  EXPECT_EQ(read_file(acc), before);
}

TEST(MagnitudeMethod, OfALevelCubeIsRefusedByName) {
  const ScratchFolder folder;
  std::string text = "x,y,z\n";
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d v = (i % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(i % 6 / 2);
    text += number_text(v.x()) + "," + number_text(v.y()) + "," + number_text(v.z()) + "\n";
  }
  const ProgramResult result = run_axiscal({"calibrate", folder.write("six.csv", text),
                                            "--instrument", "accelerometer", "--field", "gravity"});
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err, HasSubstr("x.sensitivity.y"));
}

TEST(ApplyField, TakesARecordFromOneSitesGravityToAnothers) {
  const ScratchFolder folder;
  const std::string run = folder.write(
      "run.csv", test::observations_text(test::accelerometer_truth(), {.replicates = 2}));
  const std::string record = folder.path("cal.json");
  ASSERT_EQ(run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field", "gravity",
                         "--latitude", "90", "-o", record})
                .status,
            0);
  EXPECT_NEAR(read_json(record)["field"]["local_gravity_m_s2"].get<double>(), 9.8321849379, 1e-9);
  const auto first_z = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"apply", record,
                                          folder.write("v.csv", "x,y,z\n0,0,2.5\n")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = run_axiscal(arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    return csv_cells(result.out)[1];
  };
  const double in_g = std::stod(first_z({})[5]);
  EXPECT_NEAR(std::stod(first_z({"--field-unit", "m/s^2"})[5]), in_g * 9.8321849379, 1e-9);
  // At the equator gravity is smaller, so the reading is more g. F is 1 again.
  EXPECT_NEAR(std::stod(first_z({"--latitude", "0"})[5]), in_g * 9.8321849379 / 9.7803253359, 1e-9);
  const auto there = first_z({"--field-unit", "m/s^2", "--field-magnitude", "9.7803253359"});
  EXPECT_NEAR(std::stod(there[5]), in_g * 9.8321849379, 1e-9);
  const std::string without = folder.path("without.json");
  ASSERT_EQ(run_axiscal({"calibrate", run, "--instrument", "accelerometer", "--field", "gravity",
                         "-o", without})
                .status,
            0);
  const ProgramResult refused = run_axiscal({"apply", without, run, "--field-unit", "m/s^2"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, HasSubstr("does not state local gravity"));
}

// A gyroscope with a sensitivity to gravity on a turntable. An experiment's file states all.
TEST(CalibrateCommand, FitsAGyroscopesGSensitivityAndTakesItOut) {
  const ScratchFolder folder;
  const std::string truth_text = R"({"format":"axiscal-calibration","version":1,
    "instrument":{"kind":"gyroscope","axes":["gx","gy","gz"],"unit":"V"},
    "field":{"kind":"induced_rotation","unit":"deg/s","magnitude":50,"in_table":[0,0,50]},
    "coefficients":{"bias":[0.1,0.2,-0.1],
      "sensitivity":[[0.02,0.001,0],[0,0.021,0.0005],[0.0002,0,0.019]],
      "also":{"gravity":{"unit":"g","in_table":[0,0,1],
        "sensitivity":[[0.003,0,0.001],[0,0.002,0],[0,0.001,0.004]]}}}})";
  const std::string truth = folder.write("truth.json", truth_text);
  const std::string design = folder.path("design.csv");
  std::string sheet = "rest,fence,level\n";
  for (const DesignEntry& entry : standard_design(12)) {
    for (const char* level : {"-1", "0", "1"}) {
      sheet += std::string(face_name(entry.point.rest())) + "," +
               std::string(face_name(entry.point.fence())) + "," + level + "\n";
    }
  }
  folder.write("design.csv", sheet);
  const std::string run = folder.path("run.csv");
  ASSERT_EQ(
      run_axiscal({"simulate", "--truth", truth, "--design", design, "--noise", "1e-6", "-o", run})
          .status,
      0);
  folder.write("e.json", R"({"format":"axiscal-experiment","version":1,"observations":"run.csv",
    "instrument":{"kind":"gyroscope","axes":["gx","gy","gz"],"unit":"V"},
    "field":{"kind":"induced_rotation","magnitude":50},"also":"gravity"})");
  const std::string record = folder.path("gyro.json");
  const ProgramResult result = run_axiscal({"calibrate", folder.path("e.json"), "-o", record});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Sensitivity to gravity"));
  const auto stored = read_json(record);
  EXPECT_NEAR(stored["coefficients"]["also"]["gravity"]["sensitivity"][2][2].get<double>(), 0.004,
              1e-5);
  EXPECT_EQ(stored["statistics"]["parameter_names"][4], "gx.gravity.x");
  EXPECT_EQ(calibration_json(read_calibration(record)), read_file(record));

  // The instrument is at rest with face +x up. The rate is 0 after the effect of gravity is
  // subtracted.
  const std::string log = folder.write("log.csv", "gx,gy,gz,ax,ay,az\n0.103,0.2,-0.1,1,0,0\n");
  const std::string acc = folder.write("acc.json", R"({"format":"axiscal-calibration","version":1,
    "instrument":{"kind":"accelerometer","axes":["ax","ay","az"],"unit":"g"},
    "field":{"kind":"gravity","unit":"g","magnitude":1},
    "coefficients":{"bias":[0,0,0],"sensitivity":[[1,0,0],[0,1,0],[0,0,1]]}})");
  EXPECT_EQ(run_axiscal({"apply", record, log}).status, 2);
  const ProgramResult reduced = run_axiscal({"apply", record, log, "--attitude", acc});
  ASSERT_EQ(reduced.status, 0) << reduced.err;
  for (std::size_t i = 6; i < 9; ++i) {
    EXPECT_NEAR(std::stod(csv_cells(reduced.out)[1][i]), 0.0, 2e-4);
  }
}

TEST(CalibrateCommand, MakesOneAxisOfTwoPhotodiodes) {
  const ScratchFolder folder;
  std::string text = "rest,fence,xp,xn,yp,yn,zp,zn\n";
  const Eigen::Vector3d lamp = Eigen::Vector3d(0.01, -0.005, 1.0).normalized();
  for (const DesignEntry& entry : standard_design(12)) {
    const Eigen::Vector3d f =
        Positioner().rotation_table_from_positioner(entry.point).transpose() * lamp;
    text += std::string(face_name(entry.point.rest())) + "," +
            std::string(face_name(entry.point.fence()));
    for (int k = 0; k < 6; ++k) {
      text += "," + number_text(0.1 + std::max(0.0, (k % 2 == 0 ? 2.0 : -2.0) * f(k / 2)));
    }
    text += "\n";
  }
  const std::string run = folder.write("run.csv", text);
  const std::string record = folder.path("cal.json");
  const ProgramResult result =
      run_axiscal({"calibrate", run, "--instrument", "optical", "--field", "light", "--axes",
                   "x=xp-xn,y=yp-yn,z=zp-zn", "-o", record});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("boresight x"));
  EXPECT_NEAR(read_json(record)["coefficients"]["sensitivity"][1][1].get<double>(), 2.0, 1e-9);
  EXPECT_EQ(read_json(record)["instrument"]["differences"]["z"][1], "zn");
  const ProgramResult reduced = run_axiscal({"apply", record, run});
  EXPECT_THAT(reduced.out, HasSubstr("direction_x,direction_y,direction_z,flag"));
  EXPECT_EQ(run_axiscal(
                {"calibrate", run, "--instrument", "optical", "--field", "light", "--axes", "x=xp"})
                .status,
            2);
}

TEST(ApplyField, FlagsSaturatedRows) {
  const ScratchFolder folder;
  const std::string record = folder.write("r.json", R"({"format":"axiscal-calibration","version":1,
    "instrument":{"kind":"accelerometer","axes":["x","y","z"],"unit":"V","range":[-2,2]},
    "field":{"kind":"gravity","unit":"g","magnitude":1},
    "coefficients":{"bias":[0,0,0],"sensitivity":[[1,0,0],[0,1,0],[0,0,1]]}})");
  const std::string log = folder.write("log.csv", "x,y,z\n0,0,1\n0,0,2\n");
  const ProgramResult result = run_axiscal({"apply", record, log});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, HasSubstr("0,0,2,,,,,,,,saturated\n"));
  EXPECT_THAT(result.err, HasSubstr("1 of 2 rows"));
  EXPECT_EQ(run_axiscal({"apply", record, log, "--strict"}).status, 3);
}

// Readings at the 12 standard points, each at all levels.
ProgramResult simulated_at(const ScratchFolder& folder,
                           const std::string& truth,
                           const std::vector<std::string>& levels,
                           const std::string& run) {
  std::string sheet = "rest,fence,level\n";
  for (const DesignEntry& entry : standard_design(12)) {
    for (const std::string& level : levels) {
      sheet += std::string(face_name(entry.point.rest())) + "," +
               std::string(face_name(entry.point.fence())) + "," + level + "\n";
    }
  }
  return run_axiscal({"simulate", "--truth", truth, "--design", folder.write("design.csv", sheet),
                      "--noise", "1e-6", "-o", run});
}

// The library's error states what is missing, and the command adds the options that state it.
TEST(CalibrateCommand, NamesTheOptionsThatWouldMendAnError) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv",
                                       "rest,fence,x,y,z\n-Z,-Y,0,0,9.8\n-Z,+Y,0,0,9.8\n"
                                       "+Z,-Y,0,0,-9.8\n+Z,+Y,0,0,-9.8\n");
  const ProgramResult result = run_axiscal({"calibrate", run, "--instrument", "accelerometer",
                                            "--field", "gravity", "--field-unit", "m/s^2"});
  EXPECT_EQ(result.status, 2);
  EXPECT_THAT(result.err,
              HasSubstr("its magnitude is unknown; give the magnitude, or latitude and height of "
                        "the site (--field-magnitude, --latitude, --longitude)"));
}

TEST(CalibrateCommand, AddsFieldsUpOnTheCommandLine) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", R"({"format":"axiscal-calibration",
    "version":1,"instrument":{"kind":"magnetometer","axes":["x","y","z"],"unit":"V"},
    "field":{"kind":"geomagnetic+induced_magnetic","unit":"nT","magnitude":70000,
      "in_table":[100,19000,-4000],
      "parts":[{"kind":"geomagnetic","magnitude":48000,"in_table":[0,20000,-43634.8],
                "set_by_level":false,"turning":false},
               {"kind":"induced_magnetic","magnitude":40000,"in_table":[0,0,40000],
                "set_by_level":true,"turning":false}]},
    "coefficients":{"bias":[0.1,0.2,-0.1],
      "sensitivity":[[0.00002,0,0],[0,0.000021,0],[0,0,0.000019]]}})");
  const std::string run = folder.path("run.csv");
  ASSERT_EQ(simulated_at(folder, truth, {"-1", "1"}, run).status, 0);
  const std::string record = folder.path("cal.json");
  const ProgramResult result =
      run_axiscal({"calibrate", run, "--instrument", "magnetometer", "--field",
                   "geomagnetic+induced_magnetic", "--field-magnitude", "40000", "--latitude", "48",
                   "--longitude", "11", "--date", "2026", "-o", record});
  ASSERT_EQ(result.status, 0) << result.err;
  const auto parts = read_json(record)["field"]["parts"];
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[1]["magnitude"], 40000.0);
  EXPECT_THAT(result.err, HasSubstr("138 nT"));
}

// A lamp that is switched, and room light that is not. Each part has its role, magnitude and rough
// direction.
TEST(CalibrateCommand, TakesAPartsRoleAndAValueForEachPart) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", R"({"format":"axiscal-calibration",
    "version":1,"instrument":{"kind":"optical","axes":["x","y","z"],"unit":"V"},
    "field":{"kind":"light+light","unit":"1","magnitude":1.3,"in_table":[0.7,0.4,1.2],
      "parts":[{"kind":"light","magnitude":0.5,"in_table":[0.3,0,0.4],
                "set_by_level":false,"turning":false},
               {"kind":"light","magnitude":1,"in_table":[0.48,0.36,0.8],
                "set_by_level":true,"turning":false}]},
    "coefficients":{"bias":[0.1,0.2,-0.1],
      "sensitivity":[[2,0.02,-0.01],[0.03,2.1,0.01],[-0.02,0.01,1.9]]}})");
  const std::string run = folder.path("run.csv");
  ASSERT_EQ(simulated_at(folder, truth, {"0", "1"}, run).status, 0);
  const std::string record = folder.path("cal.json");
  const auto calibrate = [&](const std::string& field, const std::string& magnitudes) {
    return run_axiscal({"calibrate", run, "--instrument", "optical", "--unit", "V", "--field",
                        field, "--field-magnitude", magnitudes, "--field-table",
                        "0.3,0.1,+0.4+0.5,0.4,7e-1", "-o", record});
  };
  const ProgramResult result = calibrate("light:local+light:induced", "0.5+1");
  ASSERT_EQ(result.status, 0) << result.err;
  const auto json = read_json(record);
  EXPECT_EQ(json["field"]["parts"][0]["set_by_level"], false);
  EXPECT_EQ(json["field"]["parts"][1]["set_by_level"], true);
  EXPECT_NEAR(json["field"]["parts"][0]["in_table"][0].get<double>(), 0.3, 1e-5);
  EXPECT_NEAR(json["coefficients"]["sensitivity"][1][1].get<double>(), 2.1, 1e-5);
  EXPECT_NEAR(json["coefficients"]["bias"][1].get<double>(), 0.2, 1e-5);

  EXPECT_THAT(calibrate("light:here+light", "0.5+1").err,
              HasSubstr("must be 'local' or 'induced'"));
  EXPECT_THAT(calibrate("light:local+light", "0.5+1+2").err, HasSubstr("has 3 values"));
  EXPECT_THAT(calibrate("gravity:induced+light", "1+1").err, HasSubstr("its role must be 'local'"));
  EXPECT_EQ(calibrate("light:here+light", "0.5+1").status, 2);
}

}  // namespace
}  // namespace axiscal
