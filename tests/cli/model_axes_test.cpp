// SPDX-License-Identifier: Apache-2.0
// The command with axes of a model, slots of several kinds, and readings that are kept out of a
// fit.
#include <cmath>

#include <gtest/gtest.h>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

class ModelAxesTest : public testing::Test {
 protected:
  ModelAxesTest() {
    folder_.write("run.csv", observations_text(accelerometer_truth(),
                                               {.points = 24, .noise_sd = 1e-4, .seed = 5}));
    EXPECT_EQ(run_axiscal({"calibrate", folder_.path("run.csv"), "--instrument", "accelerometer",
                           "--unit", "V", "--method", "joint", "-o", record_})
                  .status,
              0);
  }

  // Readings of a sensor that is mounted in a model with a rotation, at attitudes of the model
  // [deg].
  [[nodiscard]] std::string readings(const std::vector<std::array<double, 2>>& attitudes,
                                     bool with_labels,
                                     const Eigen::Matrix3d& model_from_sensor) const {
    const Calibration calibration = read_calibration(record_);
    std::string text = with_labels ? "x,y,z,pitch_deg,roll_deg\n" : "x,y,z\n";
    for (const auto& [pitch, roll] : attitudes) {
      const Eigen::Vector3d up = rotation_sensor_from_level(pitch * rad_per_deg, roll * rad_per_deg,
                                                            0.0, AxisConvention::forward_left_up)
                                     .col(2);
      const Eigen::VectorXd v = calibration.sensor.response.at(model_from_sensor.transpose() * up);
      text += number_text(v(0)) + "," + number_text(v(1)) + "," + number_text(v(2));
      text += with_labels ? "," + number_text(pitch) + "," + number_text(roll) + "\n" : "\n";
    }
    return text;
  }

  [[nodiscard]] double cell(const std::string& csv,
                            std::size_t row,
                            const std::string& name) const {
    const auto cells = csv_cells(csv);
    const auto at = std::find(cells[0].begin(), cells[0].end(), name) - cells[0].begin();
    return std::stod(cells.at(row).at(static_cast<std::size_t>(at)));
  }

  ScratchFolder folder_;
  std::string record_ = folder_.path("cal.json");
  Eigen::Matrix3d turned_ = rotation_by({0.2, -0.3, 0.4});
};

TEST_F(ModelAxesTest, AnglesAreThoseOfTheModel) {
  const std::string attitudes = folder_.write(
      "attitudes.csv", readings({{0, 0}, {20, 0}, {-20, 0}, {0, 30}, {0, -30}}, true, turned_));
  const std::string body = folder_.path("body.json");
  const ProgramResult found = run_axiscal({"calibrate", attitudes, "--method", "attitude", "--from",
                                           record_, "--direction-u", "5e-5", "-o", body});
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_EQ(read_json(body).at("format"), "axiscal-rotation");
  const std::string use = folder_.write("use.csv", readings({{12, -7}, {30, 40}}, false, turned_));
  const ProgramResult applied =
      run_axiscal({"apply", record_, use, "--body", body, "--uncertainty"});
  ASSERT_EQ(applied.status, 0) << applied.err;
  EXPECT_EQ(applied.err, "");
  EXPECT_NEAR(cell(applied.out, 1, "pitch_deg"), 12.0, 1e-6);
  EXPECT_NEAR(cell(applied.out, 1, "roll_deg"), -7.0, 1e-6);
  EXPECT_GT(cell(applied.out, 1, "u_pitch_deg"), 5e-5 * deg_per_rad / 2.0);
}

TEST_F(ModelAxesTest, AJointThatMovesIsFlagged) {
  const std::string body = folder_.path("body.json");
  const std::string attitudes = folder_.write(
      "attitudes.csv", readings({{0, 0}, {20, 0}, {-20, 0}, {0, 30}, {0, -30}}, true, turned_));
  ASSERT_EQ(run_axiscal({"calibrate", attitudes, "--method", "attitude", "--from", record_,
                         "--direction-u", "5e-5", "-o", body})
                .status,
            0);
  // Records A and B are of the same instrument. In the second row B has moved by 0.5 degrees.
  nlohmann::json one = read_json(record_);
  one["slot"] = "A";
  const std::string first = folder_.write("a.json", one.dump());
  one["slot"] = "B";
  const std::string second = folder_.write("b.json", one.dump());
  const auto still = csv_cells(readings({{5, 3}, {5, 3}}, false, turned_));
  const auto moved = csv_cells(readings({{5, 3}, {5.5, 3}}, false, turned_));
  std::string text = "A.x,A.y,A.z,B.x,B.y,B.z\n";
  for (std::size_t row = 1; row <= 2; ++row) {
    for (std::size_t k = 0; k < 6; ++k) {
      text += (k == 0 ? "" : ",") + (k < 3 ? still[row][k] : moved[row][k - 3]);
    }
    text += "\n";
  }
  const ProgramResult result =
      run_axiscal({"apply", first, folder_.write("both.csv", text), "--body", body, "--joint",
                   second + "=" + body, "--alarm", "0.1"});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_NEAR(cell(result.out, 1, "joint_deg"), 0.0, 1e-6);
  EXPECT_NEAR(cell(result.out, 2, "joint_deg"), 0.5, 1e-6);
  const auto cells = csv_cells(result.out);
  EXPECT_EQ(cells[1].back(), "");
  EXPECT_EQ(cells[2].back(), "moved");
}

TEST_F(ModelAxesTest, SaysWhatIsMissing) {
  const std::string level =
      folder_.write("level.csv", readings({{0, 0}, {0, 0}, {0, 0}}, true, turned_));
  const auto attempt = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {"calibrate", "--method", "attitude", "--from", record_};
    all.insert(all.end(), more.begin(), more.end());
    return run_axiscal(all);
  };
  const ProgramResult open = attempt({level});
  EXPECT_EQ(open.status, 1);
  EXPECT_THAT(open.err, HasSubstr("do not determine the rotation about the model's z axis"));
  EXPECT_EQ(attempt({}).status, 2);
  const ProgramResult torn =
      attempt({folder_.write("torn.csv", "x,y,z,pitch_deg,roll_deg,flat\n1,2,3,0,0,+X\n")});
  EXPECT_EQ(torn.status, 3);
  EXPECT_THAT(torn.err, HasSubstr("torn.csv:2:"));
  const ProgramResult tare =
      attempt({"--tare", folder_.write("far.csv", readings({{40, 0}}, false, turned_))});
  EXPECT_EQ(tare.status, 1);
  EXPECT_THAT(tare.err, HasSubstr("the correction by the tare would be"));
}

TEST_F(ModelAxesTest, ReadingsToBeConfirmedDecideTheStatus) {
  std::string text =
      observations_text(accelerometer_truth(), {.points = 24, .noise_sd = 1e-4, .seed = 6});
  std::string good;
  std::string bad;
  std::size_t row = 0;
  for (const auto& cells : csv_cells(text)) {
    std::string line;
    std::string other;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const bool last = k + 1 == cells.size();
      line += cells[k] + ",";
      other += (row == 5 && last ? number_text(std::stod(cells[k]) + 0.1) : cells[k]) + ",";
    }
    const char* const confirm = row == 0 ? "confirm\n" : row % 5 == 0 ? "1\n" : "0\n";
    good += line + confirm;
    bad += other + confirm;
    ++row;
  }
  const auto calibrate_with = [&](const std::string& name, const std::string& content) {
    return run_axiscal({"calibrate", folder_.write(name, content), "--instrument", "accelerometer",
                        "--unit", "V", "--method", "joint", "-o", folder_.path(name + ".json")});
  };
  const ProgramResult passed = calibrate_with("good.csv", good);
  EXPECT_EQ(passed.status, 0) << passed.err;
  EXPECT_THAT(passed.out, HasSubstr("agree with it"));
  const ProgramResult failed = calibrate_with("bad.csv", bad);
  EXPECT_EQ(failed.status, 1);
  EXPECT_FALSE(read_json(folder_.path("bad.csv.json")).at("confirmation").at("passed"));
}

TEST_F(ModelAxesTest, ThreeLabelledReadingsAreChecked) {
  const std::string all =
      observations_text(accelerometer_truth(), {.points = 12, .noise_sd = 1e-4, .seed = 9});
  std::string three;
  std::size_t row = 0;
  for (const std::string_view line : split(all, '\n')) {
    if (row == 0 || row == 1 || row == 5 || row == 9) {
      three += std::string(line) + "\n";
    }
    ++row;
  }
  const ProgramResult result =
      run_axiscal({"check", record_, folder_.write("three.csv", three), "--json"});
  EXPECT_EQ(result.status, 0) << result.err << result.out;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("changes").size(), 3U);
  EXPECT_THAT(result.err, HasSubstr("compared with the predictions of the record"));
}

TEST_F(ModelAxesTest, SlotsOfSeveralKindsAreStatedOnTheLine) {
  const auto attempt = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {"calibrate", folder_.path("run.csv")};
    all.insert(all.end(), more.begin(), more.end());
    return run_axiscal(all);
  };
  const ProgramResult missing =
      attempt({"--instrument", "L=accelerometer,M=magnetometer", "--field", "M=geomagnetic",
               "--field-magnitude", "M=48500"});
  EXPECT_EQ(missing.status, 3);
  EXPECT_THAT(missing.err, HasSubstr("'L.x'"));
  const ProgramResult twice = attempt({"--instrument", "L=accelerometer,L=magnetometer"});
  EXPECT_EQ(twice.status, 2);
  EXPECT_THAT(twice.err, HasSubstr("each slot once"));
  const ProgramResult torn = run_axiscal(
      {"calibrate", folder_.path("run.csv"), "--instrument", "accelerometer", "--unit", "nT"});
  EXPECT_EQ(torn.status, 2);
  EXPECT_THAT(torn.err, HasSubstr("readings in nT cannot be readings of gravity in g"));
  const ProgramResult unknown = attempt({"--instrument", "L=accelerometer,M=compass"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.err, HasSubstr("slot M"));
  const ProgramResult stranger =
      attempt({"--instrument", "L=accelerometer,M=magnetometer", "--unit", "L=g,N=nT"});
  EXPECT_EQ(stranger.status, 2);
  EXPECT_THAT(stranger.err, HasSubstr("'N' is not a slot; the slots are L, M"));
  const ProgramResult mixed =
      attempt({"--instrument", "accelerometer", "--temperature-column", "x=tx,ty"});
  EXPECT_EQ(mixed.status, 2);
  EXPECT_THAT(mixed.err, HasSubstr("or none"));
}

}  // namespace
}  // namespace axiscal::test
