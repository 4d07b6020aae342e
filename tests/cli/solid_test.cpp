// SPDX-License-Identifier: Apache-2.0
// The command with cubes, tables and assemblies: level, characterize, plan's forecast, slots.
#include <cmath>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/tolerance.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const std::vector<std::string> accelerometer = {"--instrument", "accelerometer", "--field",
                                                "gravity",      "--unit",        "V"};

std::vector<std::string> with(std::vector<std::string> arguments,
                              const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// Runs a command that prepares a test, and expects success.
void prepare(const std::vector<std::string>& arguments) {
  const ProgramResult result = run_axiscal(arguments);
  EXPECT_EQ(result.status, 0) << result.err;
}

const char* solid_truth_text() {
  return R"({"format":"axiscal-calibration","version":1,
    "instrument":{"kind":"accelerometer","axes":["x","y","z"],"unit":"V"},
    "field":{"kind":"gravity","unit":"g","magnitude":1.0},
    "coefficients":{"bias":[0.01,-0.02,0.03],
                    "sensitivity":[[2.5,0.01,-0.02],[0.015,2.48,0.03],[-0.01,0.02,2.52]]}})";
}

Positioner rough_cube() {
  RandomStream random(6);
  return random_positioner(feet_of_frame({}), {.fence_lean_rad = 0.003},
                           {.foot_height_m = 5e-5, .squareness_rad = 2e-3}, random);
}

double worst_error(const json& record) {
  const json truth = json::parse(solid_truth_text())["coefficients"];
  double worst = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    worst = std::max(worst, std::abs(record["coefficients"]["bias"][k].get<double>() -
                                     truth["bias"][k].get<double>()));
    for (std::size_t j = 0; j < 3; ++j) {
      worst = std::max(worst, std::abs(record["coefficients"]["sensitivity"][k][j].get<double>() -
                                       truth["sensitivity"][k][j].get<double>()));
    }
  }
  return worst;
}

// ---- cubes on feet ----

TEST(SolidCommand, SimulateAndCalibrateUseTheSameSeats) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", solid_truth_text());
  const std::string cube = folder.write("cube.json", positioner_json(rough_cube()));
  const std::string run = folder.path("run.csv");
  for (const char* design : {"12", "24"}) {
    ASSERT_EQ(run_axiscal({"simulate", "--truth", truth, "--positioner", cube, "--slope",
                           "0.02,-0.01", "--design", design, "-o", run})
                  .status,
              0);
    for (const char* method : {"paired", "joint"}) {
      const ProgramResult result = run_axiscal(with(
          {"calibrate", run, "--positioner", cube, "--method", method, "--json"}, accelerometer));
      EXPECT_EQ(result.status, 0) << result.err;
      EXPECT_LT(worst_error(json::parse(result.out)), 1e-12);
    }
  }
}

TEST(SolidCommand, SaysWhereAPositionerIsBad) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  const json good = json::parse(positioner_json(Positioner(feet_of_frame({}))));
  const auto complaint = [&](const json& file) {
    const std::string path = folder.write("cube.json", file.dump());
    const ProgramResult result =
        run_axiscal(with({"calibrate", run, "--positioner", path}, accelerometer));
    EXPECT_EQ(result.status, 3) << result.err;
    EXPECT_TRUE(result.err.starts_with(path + ": /")) << result.err;
    return result.err;
  };
  json file = good;
  file["faces"]["+X"]["feet"].erase(0);
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+X/feet: a face stands on three feet, not 2"));
  file = good;
  file["faces"]["-Z"]["feet"][1]["centre_m"] = file["faces"]["-Z"]["feet"][0]["centre_m"];
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Z/feet: the feet overlap"));
  file = good;
  file["faces"]["+Q"] = file["faces"]["+X"];
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+Q: unknown key"));
  file = good;
  file["faces"].erase("-Y");
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Y: is missing"));
  file = good;
  file["faces"]["-Y"] = {{"normal", {0.0, -1.1, 0.0}}};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Y/normal: must have unit length"));
  file = good;
  file["faces"]["+X"] = {{"normal", {-1, 0, 0}}};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+X/normal: is more than 0.2 rad"));
}

TEST(SolidCommand, RefusesASeatThatCannotBe) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  CubeFeet feet = feet_of_frame({});
  Feet& bottom = feet[static_cast<std::size_t>(Face::minus_z)];
  bottom[0].centre_m.head<2>() = Eigen::Vector2d(0.03, 0.01);
  bottom[1].centre_m.head<2>() = Eigen::Vector2d(0.005, 0.03);
  bottom[2].centre_m.head<2>() = Eigen::Vector2d(0.03, -0.02);
  const std::string cube = folder.write("cube.json", positioner_json(Positioner(feet)));
  const ProgramResult result =
      run_axiscal(with({"calibrate", run, "--positioner", cube}, accelerometer));
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err, HasSubstr("fence -Z: the cube cannot lie in this way"));
}

// ---- level ----

const char* three_screws = "0.1,0;-0.1,0.08;-0.1,-0.08";

TEST(LevelCommand, LevelsATableInOneGo) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", solid_truth_text());
  const std::string run = folder.path("run.csv");
  prepare({"simulate", "--truth", truth, "--slope", "0.004,-0.003", "--noise", "1e-5", "-o", run});
  const std::string record = folder.path("cal.json");
  ASSERT_EQ(run_axiscal(with({"calibrate", run, "-o", record}, accelerometer)).status, 0);
  const std::vector<std::string> screws = {"--adjusters", three_screws, "--thread-pitch", "0.0005",
                                           "--json"};
  const ProgramResult from_run = run_axiscal(with(with({"level", run}, accelerometer), screws));
  const ProgramResult from_record = run_axiscal(with({"level", record}, screws));
  EXPECT_EQ(from_run.status, 0) << from_run.err;
  EXPECT_EQ(from_record.out, from_run.out);
  const json level = json::parse(from_run.out);
  EXPECT_NEAR(level["slope"]["x"].get<double>(), 0.004, 1e-5);
  EXPECT_NEAR(level["slope"]["y"].get<double>(), -0.003, 1e-5);
  EXPECT_FALSE(level["level"].get<bool>());
  const double freedom =
      json::parse(read_whole_file(record))["levelness"]["degrees_of_freedom"].get<double>();
  EXPECT_NEAR(level["expanded_95"]["x"].get<double>() / level["u"]["x"].get<double>(),
              student_t_factor(0.95, freedom), 1e-9);
  double least = 1.0;
  // The raised points must form a plane with the opposite slope.
  std::vector<double> raise;
  for (const json& adjuster : level["adjusters"]) {
    raise.push_back(adjuster["raise_m"].get<double>());
    least = std::min(least, raise.back());
    EXPECT_NEAR(adjuster["turns"].get<double>(), raise.back() / 0.0005, 1e-12);
  }
  EXPECT_EQ(least, 0.0);
  EXPECT_NEAR((raise[1] + raise[2]) / 2.0 - raise[0], 0.2 * 0.004, 5e-6);
  EXPECT_NEAR(raise[2] - raise[1], -0.16 * 0.003, 5e-6);
  // On the level table nothing is left to adjust.
  prepare({"simulate", "--truth", truth, "--noise", "1e-4", "--seed", "8", "-o", run});
  const ProgramResult again =
      run_axiscal(with({"level", run, "--adjusters", three_screws}, accelerometer));
  EXPECT_THAT(again.out, HasSubstr("The slope of the table is"));
  EXPECT_THAT(again.out, HasSubstr("These readings show no significant slope"));
}

TEST(LevelCommand, TakesTheScrewsOfAPositionerAndTheLastBlock) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", solid_truth_text());
  PositionerDescription description = Positioner(feet_of_frame({})).description();
  description.surface = {.kind = SurfaceKind::separate,
                         .fence_lean_rad = 0.001,
                         .adjusters_m = {{0.1, 0.0}, {-0.1, 0.08}, {-0.1, -0.08}},
                         .thread_pitch_m = 5e-4};
  const std::string cube = folder.write("cube.json", positioner_json(Positioner(description)));
  for (const auto& [name, slope] : {std::pair{"a.csv", "0.004,0"}, {"b.csv", "0,0.002"}}) {
    prepare({"simulate", "--truth", truth, "--slope", slope, "--noise", "1e-6", "--positioner",
             cube, "-o", folder.path(name)});
  }
  const ProgramResult result =
      run_axiscal(with({"level", folder.path("a.csv"), folder.path("b.csv"), "--level-by", "block",
                        "--positioner", cube, "--json"},
                       accelerometer));
  ASSERT_EQ(result.status, 0) << result.err;
  const json level = json::parse(result.out);
  EXPECT_NEAR(level["slope"]["x"].get<double>(), 0.0, 1e-5);
  EXPECT_NEAR(level["slope"]["y"].get<double>(), 0.002, 1e-5);
  EXPECT_NEAR(level["fence_lean_when_level_rad"].get<double>(), 0.003, 1e-5);
}

TEST(LevelCommand, SaysWhatIsMissing) {
  const ScratchFolder folder;
  const std::string run = folder.write("run.csv", observations_text(accelerometer_truth(), {}));
  const auto status = [&](const std::vector<std::string>& more) {
    return run_axiscal(with(with({"level", run}, accelerometer), more));
  };
  EXPECT_EQ(status({}).status, 2);
  EXPECT_THAT(status({}).err, HasSubstr("--adjusters"));
  EXPECT_EQ(status({"--adjusters", "0,0;1,1"}).status, 2);
  EXPECT_THAT(status({"--adjusters", "0,0;1,1;2,2"}).err, HasSubstr("in a line"));
  EXPECT_EQ(status({"--adjusters", "0,0;1"}).status, 2);
  EXPECT_EQ(status({"--adjusters", three_screws, "--thread-pitch", "0"}).status, 2);
  // Six points do not determine the slope.
  const std::string six =
      folder.write("six.csv", observations_text(accelerometer_truth(), {.points = 6}));
  const ProgramResult refused = run_axiscal(
      with({"level", six, "--method", "known", "--adjusters", three_screws}, accelerometer));
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr("turned by 180 degrees"));
  const std::string truth = folder.write("truth.json", solid_truth_text());
  EXPECT_EQ(run_axiscal({"level", truth, "--adjusters", three_screws}).status, 1);
  EXPECT_EQ(run_axiscal({"level", folder.path("none.json"), "--adjusters", three_screws}).status,
            3);
}

// ---- a levelness for each block ----

TEST(CalibrateCommand, GivesEachBlockItsLevelnessOnRequest) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", solid_truth_text());
  for (const auto& [name, slope] : {std::pair{"a.csv", "0.02,0"}, {"b.csv", "-0.01,0.015"}}) {
    prepare({"simulate", "--truth", truth, "--slope", slope, "-o", folder.path(name)});
  }
  for (const char* method : {"paired", "joint"}) {
    const std::vector<std::string> call = with(
        {"calibrate", folder.path("a.csv"), folder.path("b.csv"), "--method", method, "--json"},
        accelerometer);
    const ProgramResult moved = run_axiscal(call);
    EXPECT_THAT(moved.err, HasSubstr("'level_by'"));
    const json record = json::parse(run_axiscal(with(call, {"--level-by", "block"})).out);
    EXPECT_LT(worst_error(record), 1e-12);
    EXPECT_EQ(record["status"], "ok");
    EXPECT_EQ(record["level_by"], "block");
    EXPECT_NEAR(record["levelness"]["blocks"][1]["x"].get<double>(), -0.01, 1e-12);
  }
  EXPECT_EQ(run_axiscal(with({"calibrate", folder.path("a.csv"), "--method", "known", "--level-by",
                              "block"},
                             accelerometer))
                .status,
            2);
  EXPECT_EQ(
      run_axiscal(with({"calibrate", folder.path("a.csv"), "--level-by", "day"}, accelerometer))
          .status,
      2);
}

// ---- assemblies ----

TEST(CalibrateCommand, WritesARecordForEachSlot) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", solid_truth_text());
  const std::string run = folder.path("run.csv");
  ASSERT_EQ(run_axiscal({"simulate", "--truth", "L=" + truth, "--truth", "R=" + truth, "--assembly",
                         "h", "--slope", "0.001,0.002", "--noise", "1e-5", "-o", run})
                .status,
            0);
  EXPECT_THAT(csv_cells(read_file(run))[0],
              testing::ElementsAre("run", "block", "rest", "fence", "L.x", "L.y", "L.z", "R.x",
                                   "R.y", "R.z"));
  const std::vector<std::string> call = with({"calibrate", run, "--assembly", "h"}, accelerometer);
  const ProgramResult result = run_axiscal(with(call, {"-o", folder.path("cal-{slot}.json")}));
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("in slot R"));
  EXPECT_THAT(result.out, HasSubstr("is also fitted"));
  for (const char* slot : {"L", "R"}) {
    const json record = read_json(folder.path("cal-" + std::string(slot) + ".json"));
    EXPECT_LT(worst_error(record), 5e-5);
    EXPECT_EQ(record["slot"], slot);
    EXPECT_NEAR(record["levelness"]["combined"]["y"].get<double>(), 0.002, 1e-5);
  }
  EXPECT_EQ(json::parse(run_axiscal(with(call, {"--json"})).out).size(), 2U);
  // The log of the whole assembly is reduced with one instrument's record.
  const ProgramResult applied = run_axiscal({"apply", folder.path("cal-R.json"), run});
  EXPECT_EQ(applied.status, 0) << applied.err;
  EXPECT_THAT(applied.out, HasSubstr("field_x"));
  // Two records need two file names.
  const ProgramResult one_name = run_axiscal(with(call, {"-o", folder.path("cal.json")}));
  EXPECT_EQ(one_name.status, 2);
  EXPECT_THAT(one_name.err, HasSubstr("{slot}"));
  EXPECT_EQ(run_axiscal(with({"calibrate", run, "--slot", "L"}, accelerometer)).status, 2);
  EXPECT_EQ(run_axiscal(with({"calibrate", run, "--assembly", "star"}, accelerometer)).status, 2);
}

TEST(CalibrateCommand, TakesTheMountsOfAPositioner) {
  const ScratchFolder folder;
  const std::string truth = folder.write("truth.json", solid_truth_text());
  const std::string cube = folder.write(
      "cube.json", positioner_json(rough_cube().with_mounts(h_shaped_mounts("L", "R"))));
  const std::string run = folder.path("run.csv");
  prepare({"simulate", "--truth", truth, "--slot", "R", "--positioner", cube, "-o", run});
  const json record = json::parse(
      run_axiscal(
          with({"calibrate", run, "--positioner", cube, "--slot", "R", "--json"}, accelerometer))
          .out);
  EXPECT_LT(worst_error(record), 1e-12);
  const ProgramResult unstated =
      run_axiscal(with({"calibrate", run, "--positioner", cube}, accelerometer));
  EXPECT_THAT(unstated.err, HasSubstr("because no slot is named"));
  EXPECT_EQ(
      run_axiscal(with({"calibrate", run, "--positioner", cube, "--slot", "X"}, accelerometer))
          .status,
      2);
}

TEST(CalibrateCommand, NamesTheColumnThatASlotLacks) {
  const ScratchFolder folder;
  const std::string run =
      folder.write("run.csv", "rest,fence,L.x,L.y,L.z,R.x,R.y\n-Z,+X,0,0,1,0,0\n");
  const ProgramResult result = run_axiscal(with({"calibrate", run}, accelerometer));
  EXPECT_EQ(result.status, 3);
  EXPECT_THAT(result.err, HasSubstr("run.csv:1: column 'R.z' is missing"));
}

// ---- characterize ----

struct Laboratory {
  ScratchFolder folder;
  std::string truth = folder.write("truth.json", solid_truth_text());
  std::string cube = folder.write("new.json", positioner_json(Positioner(rough_cube().normals())));

  // Makes an instrument's record and its readings in the new cube. @return the argument of
  // --reference.
  [[nodiscard]] std::string reference(const std::string& name, const std::string& seed) const {
    const std::string run = folder.path("run.csv");
    prepare({"simulate", "--truth", truth, "--noise", "1e-5", "--replicates", "3", "--seed", seed,
             "-o", run});
    prepare(with({"calibrate", run, "--serial", name, "-o", folder.path(name + ".json")},
                 accelerometer));
    prepare({"simulate", "--truth", truth, "--noise", "1e-5", "--replicates", "2", "--seed",
             seed + "1", "--slope", "0.004,-0.003", "--positioner", cube, "-o",
             folder.path(name + ".csv")});
    return folder.path(name + ".json") + "=" + folder.path(name + ".csv");
  }
};

TEST(CharacterizeCommand, MeasuresACube) {
  const Laboratory lab;
  const std::string out = lab.folder.path("cube-07.json");
  const std::vector<std::string> call = {"characterize",
                                         "--reference",
                                         lab.reference("A", "2"),
                                         "--reference",
                                         lab.reference("B", "3"),
                                         "--reference",
                                         lab.reference("C", "4"),
                                         "--id",
                                         "cube-07"};
  const ProgramResult result = run_axiscal(with(call, {"-o", out}));
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the instruments"));
  EXPECT_THAT(result.out, HasSubstr("If the cube has feet or the fence leans"));
  const json file = read_json(out);
  EXPECT_EQ(file["id"], "cube-07");
  EXPECT_EQ(file["normal_covariance"].size(), 18U);
  EXPECT_EQ(file["mounts"].size(), 3U);
  EXPECT_EQ(file["from"]["references"][1]["record"], lab.folder.path("B.json"));
  EXPECT_EQ(file["from"]["references"][1]["observations"], lab.folder.path("B.csv"));
  // The written cube with the mount of its reference instrument gives the true coefficients.
  const ProgramResult fresh = run_axiscal(
      with({"calibrate", lab.folder.path("A.csv"), "--positioner", out, "--slot", "A", "--json"},
           accelerometer));
  EXPECT_LT(worst_error(json::parse(fresh.out)), 3e-5);
  const ProgramResult nominal =
      run_axiscal(with({"calibrate", lab.folder.path("A.csv"), "--json"}, accelerometer));
  EXPECT_GT(worst_error(json::parse(nominal.out)), 20 * worst_error(json::parse(fresh.out)));
  const json printed = json::parse(run_axiscal(with(call, {"-o", out, "--json"})).out);
  EXPECT_TRUE(printed["consistent"].get<bool>());
  EXPECT_EQ(printed["references"].size(), 3U);
  // If a record is named twice, the instrument was mounted twice. If readings are named twice, that
  // is an error.
  const std::string again = lab.folder.path("A.json") + "=" + lab.folder.path("A.csv");
  const std::string refit = lab.folder.path("A.json") + "=" + lab.folder.path("B.csv");
  EXPECT_EQ(run_axiscal({"characterize", "--reference", again, "--reference", again, "--id", "x",
                         "-o", out})
                .status,
            2);
  const ProgramResult refits = run_axiscal(
      {"characterize", "--reference", again, "--reference", refit, "--id", "x", "-o", out});
  EXPECT_THAT(refits.out, HasSubstr("mount repeatability of A"));
  EXPECT_TRUE(read_json(out)["mounts"].contains("A#2"));
}

TEST(CharacterizeCommand, TakesSeveralInstrumentsFromOneFile) {
  const Laboratory lab;
  const auto path = [&](const std::string& name) { return lab.folder.path(name); };
  // Two instruments are calibrated together in the old cube and read together in the new cube.
  const auto simulate = [&](const std::string& out, const std::vector<std::string>& more) {
    prepare(with({"simulate", "--truth", "L=" + lab.truth, "--truth", "R=" + lab.truth, "--noise",
                  "1e-5", "--replicates", "2", "-o", path(out)},
                 more));
  };
  simulate("old.csv", {});
  simulate("new.csv", {"--positioner", lab.cube, "--slope", "0.003,0.001", "--seed", "4"});
  prepare(
      with({"calibrate", path("old.csv"), "--assembly", "parallel", "-o", path("c-{slot}.json")},
           accelerometer));
  const std::vector<std::string> by_record = {"characterize",
                                              "--reference",
                                              path("c-L.json") + "=" + path("new.csv"),
                                              "--reference",
                                              path("c-R.json") + "=" + path("new.csv"),
                                              "--id",
                                              "x",
                                              "-o",
                                              path("x.json")};
  EXPECT_EQ(run_axiscal(by_record).status, 0);
  EXPECT_TRUE(read_json(path("x.json"))["mounts"].contains("R"));
  // If a record has no slot, --reference must state the slot of its columns.
  const std::string plain = lab.reference("A", "2");
  EXPECT_EQ(run_axiscal({"characterize", "--reference", path("A.json") + "=" + path("new.csv"),
                         "--id", "x", "-o", path("y.json")})
                .status,
            3);
  EXPECT_EQ(
      run_axiscal({"characterize", "--reference", path("A.json") + "=" + path("new.csv") + ":R",
                   "--id", "x", "-o", path("y.json")})
          .status,
      0);
  EXPECT_TRUE(read_json(path("y.json"))["mounts"].contains("R"));
  EXPECT_FALSE(plain.empty());
}

TEST(CharacterizeCommand, NamesTheBadInstrument) {
  const Laboratory lab;
  const std::string a = lab.reference("A", "2");
  const std::string b = lab.reference("B", "3");
  const std::string c = lab.reference("C", "4");
  json bent = read_json(lab.folder.path("B.json"));
  bent["coefficients"]["sensitivity"][0][1] =
      bent["coefficients"]["sensitivity"][0][1].get<double>() + 2e-3;
  lab.folder.write("B.json", bent.dump());
  const std::string out = lab.folder.path("cube.json");
  const std::vector<std::string> call = {
      "characterize", "--reference", a, "--reference", b, "--reference", c, "--id", "x", "-o", out};
  const ProgramResult result = run_axiscal(call);
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("slot B gives different face normals"));
  const ProgramResult without = run_axiscal(with(call, {"--leave-out", "B"}));
  EXPECT_EQ(without.status, 0);
  EXPECT_THAT(without.err, testing::Not(HasSubstr("disagree")));
  EXPECT_EQ(read_json(out)["mounts"].size(), 2U);
  EXPECT_EQ(run_axiscal(with(call, {"--leave-out", "X"})).status, 2);
}

TEST(CharacterizeCommand, SaysWhatIsWrong) {
  const Laboratory lab;
  const std::string good = lab.reference("A", "2");
  const std::string out = lab.folder.path("cube.json");
  const auto call = [&](const std::string& reference) {
    return run_axiscal({"characterize", "--reference", reference, "--id", "x", "-o", out});
  };
  EXPECT_EQ(call("nothing").status, 2);
  EXPECT_EQ(call(lab.folder.path("A.csv") + "=" + lab.folder.path("A.json")).status, 3);
  EXPECT_EQ(call(lab.folder.path("none.json") + "=" + lab.folder.path("A.csv")).status, 3);
  const std::string three = lab.folder.write(
      "three.csv", "rest,fence,x,y,z\n-Z,+X,0,0,2.5\n-Z,-X,0,0,2.5\n+Z,+X,0,0,-2.5\n");
  const ProgramResult few = call(lab.folder.path("A.json") + "=" + three);
  EXPECT_EQ(few.status, 1);
  EXPECT_THAT(few.err, HasSubstr("no reading has the rest face +X, -X, +Y, -Y"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(run_axiscal({"characterize", "--id", "x", "-o", out}).status, 2);
  EXPECT_EQ(run_axiscal({"characterize", "--reference", good, "--id", "x"}).status, 2);
  EXPECT_EQ(run_axiscal(
                {"characterize", "--reference", good, "--id", "x", "-o", lab.folder.path("A.json")})
                .status,
            2);
}

// ---- plan ----

TEST(PlanCommand, ForecastsAndFindsTheReplicates) {
  const ScratchFolder folder;
  const std::string sheet = folder.path("sheet.csv");
  const std::vector<std::string> call = {"plan",  "--noise", "3e-4", "--want-angle-deg",
                                         "0.005", "-o",      sheet};
  const ProgramResult result = run_axiscal(with(call, {"--json"}));
  ASSERT_EQ(result.status, 0) << result.err;
  const json plan = json::parse(result.out);
  EXPECT_EQ(plan["wanted"]["replicates"], 4);
  EXPECT_EQ(csv_cells(read_file(sheet)).size(), 49U);
  EXPECT_NEAR(plan["forecast"]["angle_u_deg"].get<double>(),
              3e-4 / std::sqrt(12.0) * 57.29577951308232, 1e-9);
  EXPECT_NEAR(plan["forecast"]["standard_uncertainty"]["bias"][0].get<double>(),
              3e-4 / std::sqrt(48.0), 1e-12);
  EXPECT_NEAR(plan["design"]["d_efficiency"].get<double>(), 1.0, 1e-12);
  EXPECT_THAT(run_axiscal(call).out, HasSubstr("4 replicates of 1 sample"));
  // The uncertainty of the cube is larger than the wanted uncertainty.
  const ProgramResult never = run_axiscal(with(call, {"--positioner-u", "1e-3"}));
  EXPECT_EQ(never.status, 1);
  EXPECT_THAT(never.err, HasSubstr("no number of replicates"));
  EXPECT_EQ(run_axiscal({"plan", "--want-angle-deg", "0.005", "-o", sheet}).status, 2);
  EXPECT_EQ(run_axiscal({"plan", "--noise", "-1", "-o", sheet}).status, 2);
  EXPECT_EQ(run_axiscal({"plan", "--noise", "1", "--samples", "0", "-o", sheet}).status, 2);
}

TEST(PlanCommand, MakesAPageAndDesignsOfAnySize) {
  const ScratchFolder folder;
  const std::string page = folder.path("sheet.html");
  const ProgramResult result = run_axiscal(
      {"plan", "--design", "optimal:10", "--page", page, "-o", folder.path("sheet.csv")});
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the 12-point design has 1.0000"));
  EXPECT_EQ(csv_cells(read_file(folder.path("sheet.csv"))).size(), 11U);
  EXPECT_THAT(read_file(page), HasSubstr("<svg"));
  for (const char* design : {"optimal:3", "optimal:25", "optimal:x"}) {
    EXPECT_EQ(run_axiscal({"plan", "--design", design}).status, 2) << design;
  }
  EXPECT_EQ(run_axiscal({"plan", "--page", "/nowhere/x.html", "-o", "/dev/null"}).status, 4);
}

TEST(PlanCommand, StudiesTolerances) {
  const ScratchFolder folder;
  const ProgramResult result = run_axiscal(
      {"plan", "--tolerances", "foot_height_m=5e-6,fence_rad=1e-3", "--trials", "200", "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  const json paired = json::parse(result.out)["tolerances"]["paired"];
  EXPECT_NEAR(paired["simulated"]["angle_rad"].get<double>() /
                  paired["closed_form"]["angle_rad"].get<double>(),
              1.0, 0.15);
  EXPECT_EQ(run_axiscal({"plan", "--tolerances", "foot=1"}).status, 2);
  EXPECT_EQ(run_axiscal({"plan", "--tolerances", "foot_height_m=-1"}).status, 2);
}

TEST(PlanCommand, PlansAnExperimentFromItsFile) {
  const ScratchFolder folder;
  const std::string cube = folder.write("cube.json", positioner_json(rough_cube()));
  const std::string experiment = folder.write(
      "e.json",
      R"({"format":"axiscal-experiment","version":1,"instrument":{"kind":"inclinometer",
          "serial":"Q<1>","axes":["x","y"],"unit":"V"},"field":{"kind":"gravity"},
          "positioner":"cube.json","method":"joint"})");
  const ProgramResult result = run_axiscal(
      {"plan", experiment, "--noise", "1e-4", "--json", "--page", folder.path("p.html")});
  ASSERT_EQ(result.status, 0) << result.err;
  const json plan = json::parse(result.out);
  EXPECT_EQ(plan["method"], "joint");
  EXPECT_EQ(plan["forecast"]["standard_uncertainty"]["bias"].size(), 2U);
  EXPECT_THAT(read_file(folder.path("p.html")), HasSubstr("Run sheet of Q&lt;1&gt;"));
}

}  // namespace
}  // namespace axiscal::test
