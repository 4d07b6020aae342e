// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/positioner_json.hpp"

#include <nlohmann/json.hpp>

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

nlohmann::json nominal_file() {
  nlohmann::json file = {{"format", "axiscal-positioner"}, {"version", 1}, {"id", "cube-07"}};
  for (const Face face : all_faces) {
    const Eigen::Vector3d n = nominal_normal(face);
    file["faces"][std::string(face_name(face))]["normal"] = {n.x(), n.y(), n.z()};
  }
  return file;
}

std::string complaint(const nlohmann::json& file) {
  return test::complaint_of<DataError>(
      [&] { static_cast<void>(parse_positioner(file.dump(), "cube.json")); });
}

TEST(ParsePositioner, ReadsNormals) {
  nlohmann::json file = nominal_file();
  file["faces"]["+X"]["normal"] = {0.9999995, 0.001, 0.0};
  const Positioner cube = parse_positioner(file.dump(), "cube.json");
  EXPECT_EQ(cube.id(), "cube-07");
  EXPECT_MATRIX_NEAR(cube.normal(Face::plus_x), Eigen::Vector3d(0.9999995, 0.001, 0.0), 1e-9);
  EXPECT_EQ(cube.normal(Face::minus_z), Eigen::Vector3d(0.0, 0.0, -1.0));
}

TEST(ParsePositioner, SaysWhatIsWrongWhere) {
  nlohmann::json file = nominal_file();
  file["faces"].erase("-Y");
  EXPECT_THAT(complaint(file), HasSubstr("cube.json: /faces/-Y: is missing"));
  file = nominal_file();
  file["faces"]["+W"] = file["faces"]["+X"];
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+W: unknown key; did you mean '+X'?"));
  file = nominal_file();
  file["faces"]["+Z"]["normal"] = {0.0, 0.0, 1.1};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+Z/normal: must have unit length"));
  file = nominal_file();
  file["faces"]["+Z"]["normal"] = {0.0, 0.0, -1.0};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+Z/normal: is more than 0.2 rad"));
  file["faces"]["+Z"]["normal"] = {0.0, "a", 1.0};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+Z/normal/1: must be a number"));
  file = nominal_file();
  file["version"] = 2;
  EXPECT_THAT(complaint(file), HasSubstr("cube.json: /version: version 2 is not supported"));
  file = nominal_file();
  file["format"] = "axiscal-calibration";
  EXPECT_THAT(complaint(file), HasSubstr("/format: must be \"axiscal-positioner\""));
}

nlohmann::json feet_file() {
  nlohmann::json file = {{"format", "axiscal-positioner"}, {"version", 1}, {"id", "cube-08"}};
  const CubeFeet cube = feet_of_frame({});
  for (const Face face : all_faces) {
    for (const Ball& ball : cube[static_cast<std::size_t>(face)]) {
      file["faces"][std::string(face_name(face))]["feet"].push_back(
          {{"centre_m", {ball.centre_m.x(), ball.centre_m.y(), ball.centre_m.z()}},
           {"radius_m", ball.radius_m}});
    }
  }
  return file;
}

TEST(ParsePositioner, ReadsFeetMountsAndTable) {
  nlohmann::json file = feet_file();
  file["mounts"]["B"] = {{"rotation_sensor_from_positioner", {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}},
                         {"repeatability_rad", 2e-5}};
  file["mounts"]["A"] = {{"rotation_sensor_from_positioner", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
  file["table"] = {{"fence_lean_rad", 0.003},
                   {"adjusters",
                    {{{"x_m", 0.1}, {"y_m", 0.0}},
                     {{"x_m", -0.1}, {"y_m", 0.1}},
                     {{"x_m", -0.1}, {"y_m", -0.1}}}},
                   {"thread_pitch_m", 5e-4},
                   {"surface", "separate"}};
  const Positioner cube = parse_positioner(file.dump(), "cube.json");
  ASSERT_TRUE(cube.feet(Face::minus_y));
  EXPECT_EQ((*cube.feet(Face::minus_y))[1].radius_m, 0.003);
  EXPECT_NEAR(cube.normal(Face::minus_y).y(), -1.0, 1e-15);
  EXPECT_FALSE(cube.is_nominal());
  ASSERT_EQ(cube.mounts().size(), 2U);
  EXPECT_EQ(cube.mount("B")->repeatability_rad, 2e-5);
  EXPECT_FALSE(cube.mount("C"));
  EXPECT_EQ(cube.surface().fence_lean_rad, 0.003);
  EXPECT_EQ(cube.surface().kind, SurfaceKind::separate);
  EXPECT_EQ(cube.surface().adjusters_m.front(), Eigen::Vector2d(0.1, 0.0));

  // The cube is the same after it is written and read again.
  const std::string text = positioner_json(cube);
  EXPECT_EQ(positioner_json(parse_positioner(text, "again.json")), text);
}

TEST(ParsePositioner, ReadsAndWritesCovarianceAndOrigin) {
  nlohmann::json file = nominal_file();
  file["normal_covariance"] = nlohmann::json::array();
  for (int i = 0; i < 18; ++i) {
    nlohmann::json row = nlohmann::json::array();
    for (int j = 0; j < 18; ++j) {
      row.push_back(i == j ? 1e-10 : 0.0);
    }
    file["normal_covariance"].push_back(row);
  }
  file["created"] = "2026-11-21T10:00:00Z";
  file["from"] = {
      {"references", {{{"slot", "A"}, {"record", "a.json"}, {"observations", "a.csv"}}}},
      {"notes", {"warm"}}};
  const Positioner cube = parse_positioner(file.dump(), "cube.json");
  ASSERT_TRUE(cube.description().normal_covariance);
  EXPECT_EQ((*cube.description().normal_covariance)(3, 3), 1e-10);
  EXPECT_EQ(cube.description().from.front().record, "a.json");
  const std::string text = positioner_json(cube);
  EXPECT_EQ(positioner_json(parse_positioner(text, "again.json")), text);
  file["normal_covariance"][0][0] = -1.0;
  EXPECT_THAT(complaint(file),
              HasSubstr("/normal_covariance: normal_covariance must be symmetric"));
  file["normal_covariance"].erase(0);
  EXPECT_THAT(complaint(file), HasSubstr("/normal_covariance: must have 18 rows"));
}

TEST(ParsePositioner, SaysWhatIsWrongWithFeet) {
  nlohmann::json file = feet_file();
  file["faces"]["+X"]["feet"].erase(2);
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+X/feet: a face stands on three feet, not 2"));
  file = feet_file();
  file["faces"]["+X"]["feet"][2] = file["faces"]["+X"]["feet"][1];
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+X/feet: the feet overlap"));
  file = feet_file();
  file["faces"]["-Z"]["feet"][0]["centre_m"] = {0.027, 0.009, -0.036};
  file["faces"]["-Z"]["feet"][1]["centre_m"] = {0.0, 0.009, -0.036};
  file["faces"]["-Z"]["feet"][2]["centre_m"] = {-0.027, 0.009, -0.036};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Z/feet: the feet are in a line"));
  file = feet_file();
  file["faces"]["-Z"]["feet"][1]["radius_m"] = -0.001;
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Z/feet/1/radius_m: must not be negative"));
  file = feet_file();
  file["faces"]["-Z"]["feet"][1]["radius"] = 0.001;
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Z/feet/1/radius: unknown key"));
  file = feet_file();
  file["faces"]["-Z"] = nlohmann::json::object();
  EXPECT_THAT(complaint(file), HasSubstr("/faces/-Z: needs a 'normal' or 'feet'"));
  file = feet_file();
  std::swap(file["faces"]["+X"], file["faces"]["-X"]);
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+X/feet: the feet are on the wrong side"));
}

TEST(ParsePositioner, SaysThatACubeIsLeftHanded) {
  nlohmann::json file = nominal_file();
  std::swap(file["faces"]["+Y"], file["faces"]["-Y"]);
  EXPECT_THAT(complaint(file), HasSubstr("/faces: the normals are those of a left-handed cube"));
  file = nominal_file();
  std::swap(file["faces"]["+X"], file["faces"]["+Y"]);
  std::swap(file["faces"]["-X"], file["faces"]["-Y"]);
  EXPECT_THAT(complaint(file), HasSubstr("/faces: the normals are those of a left-handed cube"));
}

TEST(ParsePositioner, SaysWhatIsWrongWithMountsAndTable) {
  nlohmann::json file = nominal_file();
  file["mounts"]["A"] = {{"rotation_sensor_from_positioner", {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}}};
  EXPECT_THAT(complaint(file), HasSubstr("/mounts/A/rotation_sensor_from_positioner: slot A: "
                                         "rotation_sensor_from_positioner is not a rotation"));
  file["mounts"]["A"] = {{"repeatability_rad", 0.0}};
  EXPECT_THAT(complaint(file), HasSubstr("/mounts/A/rotation_sensor_from_positioner: is missing"));
  file = nominal_file();
  file["table"]["fence_lean_rad"] = 2.0;
  EXPECT_THAT(complaint(file), HasSubstr("/table/fence_lean_rad: the fence must lean"));
  file["table"] = {{"thread_pitch_m", -1.0}};
  EXPECT_THAT(complaint(file), HasSubstr("/table/thread_pitch_m: must be positive"));
  file["table"] = {{"adjusters", {{{"x_m", 0.1}, {"y_m", 0.0}}}}};
  EXPECT_THAT(complaint(file), HasSubstr("/table/adjusters: a table needs at least three"));
  file["table"] = {{"surface", "marble"}};
  EXPECT_THAT(complaint(file), HasSubstr("/table/surface: must be"));
}

TEST(ParsePositioner, CountsLinesOfBrokenJson) {
  try {
    static_cast<void>(parse_positioner("{\n\"format\": \"x\",\n oops }", "cube.json"));
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cube.json:3: not valid JSON"));
  }
}

}  // namespace
}  // namespace axiscal
