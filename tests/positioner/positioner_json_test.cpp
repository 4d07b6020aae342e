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
  EXPECT_THAT(complaint(file), HasSubstr("cube.json: /version: version 2 is not known"));
  file = nominal_file();
  file["format"] = "axiscal-calibration";
  EXPECT_THAT(complaint(file), HasSubstr("/format: must be \"axiscal-positioner\""));
}

TEST(ParsePositioner, RefusesKeysItCannotUseYet) {
  nlohmann::json file = nominal_file();
  file["faces"]["+X"] = {{"feet", nlohmann::json::array()}};
  EXPECT_THAT(complaint(file), HasSubstr("/faces/+X/feet: this version"));
  file = nominal_file();
  file["mounts"] = nlohmann::json::object();
  EXPECT_THAT(complaint(file), HasSubstr("/mounts: this version"));
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
