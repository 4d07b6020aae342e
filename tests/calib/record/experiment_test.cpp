// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json whole_experiment() {
  return json::parse(R"({
    "format": "axiscal-experiment", "version": 1, "observations": ["a.csv", "/tmp/b.csv"],
    "instrument": {"kind": "inclinometer", "serial": "7", "axes": ["p", "q"], "unit": "V",
                   "convention": "frd"},
    "field": {"kind": "gravity", "unit": "m/s^2", "in_table": [0, 0.1, 9.8]},
    "site": {"latitude_deg": 52, "longitude_deg": 8.5, "height_m": 100, "date": 2026.5},
    "table": {"fence_azimuth_deg": 90, "slope": [0.001, -0.002]},
    "method": "known", "weights": "sd", "robust": true, "leave_out": [3, 4], "level_by": "run",
    "temperature": {"order": 0}})");
}

std::string experiment_complaint(const json& experiment) {
  return test::complaint_of<DataError>(
      [&] { static_cast<void>(parse_experiment(experiment.dump(), "dir/e.json")); });
}

TEST(ParseExperiment, ReadsEverything) {
  const ExperimentFile read = parse_experiment(whole_experiment().dump(), "dir/e.json");
  const Experiment& experiment = read.experiment;
  EXPECT_THAT(read.paths.observations, testing::ElementsAre("dir/a.csv", "/tmp/b.csv"));
  EXPECT_EQ(experiment.instrument.kind, "inclinometer");
  EXPECT_EQ(experiment.instrument.axes.size(), 2U);
  EXPECT_EQ(experiment.instrument.convention, AxisConvention::forward_right_down);
  EXPECT_EQ(experiment.field.in_table->z(), 9.8);
  EXPECT_EQ(experiment.table.site->height_m, 100.0);
  EXPECT_EQ(experiment.table.date, "2026.5");
  EXPECT_DOUBLE_EQ(experiment.table.fence_azimuth_rad.value(), 90.0 * rad_per_deg);
  EXPECT_EQ(experiment.table.slope.y(), -0.002);
  EXPECT_EQ(experiment.fit.method, Method::known);
  EXPECT_EQ(experiment.fit.weighting, Weighting::sd);
  EXPECT_TRUE(experiment.fit.robust);
  EXPECT_THAT(experiment.leave_out, testing::ElementsAre(3, 4));
}

TEST(ParseExperiment, ReadsTheRolesOfAFieldsParts) {
  json file = whole_experiment();
  file["field"] = json::parse(R"([{"kind":"light","role":"local","in_table":[0.3,0,0.4]},
                                  {"kind":"light","in_table":[0,0,1]},
                                  {"kind":"custom","role":"induced","in_table":[1,0,0]}])");
  file["table"].erase("slope");
  const Experiment experiment = parse_experiment(file.dump(), "dir/e.json").experiment;
  EXPECT_EQ(experiment.field.role, FieldRole::local);
  EXPECT_FALSE(experiment.field.is_induced());
  EXPECT_TRUE(experiment.field.others[0].is_induced());
  EXPECT_TRUE(experiment.field.others[1].is_induced());
  const FieldDescription field = make_field_description(experiment);
  EXPECT_FALSE(field.parts[0].set_by_level);
  EXPECT_TRUE(field.parts[1].set_by_level);
  file["field"][0]["role"] = "mine";
  EXPECT_THAT(experiment_complaint(file), HasSubstr("/field/0/role: 'mine' is not a known value"));
}

// A field class of a program. Files cannot name it.
class WindMachine final : public ReferenceField {
 public:
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return {0.0, 20.0, 9.8}; }
  [[nodiscard]] std::string_view unit() const override { return "m/s^2"; }
  [[nodiscard]] std::string_view kind() const override { return "wind machine"; }
};

TEST(CanBeStated, LooksAtEveryPartOfEveryField) {
  Experiment experiment;
  experiment.field = GravityField();
  EXPECT_TRUE(can_be_stated(experiment));
  Experiment further = experiment;
  further.field += WindMachine();
  EXPECT_FALSE(can_be_stated(further));
  EXPECT_THROW(static_cast<void>(experiment_json(further)), DomainError);
  Experiment second = experiment;
  second.also.emplace_back(WindMachine());
  EXPECT_FALSE(can_be_stated(second));
  EXPECT_THROW(static_cast<void>(experiment_json(second)), DomainError);
}

// An experiment with every key is the same after it is written and read.
TEST(ExperimentJson, ComesBackAsItWas) {
  json file = whole_experiment();
  file["also"] = "gravity";
  file["nominal_sensitivity"] = 2.5;
  file["noise_ratio"] = {1.0, 2.0};
  file["uncertainty"] = {{"resolution", 1e-3}, {"temperature", 0.1}};
  file["temperature"] = {{"order", "auto"}, {"reference", 21.5}};
  file["drift"] = "none";
  file["mistakes"] = false;
  file["slot"] = "L";
  file["limits"] = "l.json";
  file["process"] = {{"mean_square", {1e-8, 2e-8}}, {"degrees_of_freedom", 4}, {"records", 3}};
  const std::vector<json> fields = {
      json::parse(R"({"kind": "gravity", "unit": "m/s^2", "in_table": [0, 0.1, 9.8]})"),
      json::parse(R"({"kind": "light", "source": "sun", "refraction": true})"),
      json::parse(R"([{"kind": "geomagnetic", "model": "wmm2025", "magnitude": "unknown"},
                      {"kind": "induced_magnetic", "name": "up", "coil": {"turns": 3,
                       "current_A": 0.5, "size_m": 0.2, "shape": "merritt"}}])"),
      json::parse(R"([{"kind": "light", "role": "local"},
                      {"kind": "light", "magnitude": 2, "magnitude_u": 0.01,
                       "lamps": [{"direction_in_table": [0, 1, 1], "irradiance": 2}]}])"),
      json::parse(R"({"kind": "custom", "unit": "V/m", "in_enu": [1, 2, 3]})"),
      json::parse(R"({"kind": "induced_rotation", "magnitude": 90})"),
      json::parse(R"({"kind": "earth_rotation", "site": {"latitude_deg": 48}})")};
  for (const json& field : fields) {
    file["field"] = field;
    file["table"] = {{"fence_azimuth_deg", 90}};
    const ExperimentFile first = parse_experiment(file.dump(), "e.json");
    const std::string text = experiment_json(first.experiment, first.paths);
    const ExperimentFile second = parse_experiment(text, "e.json");
    EXPECT_EQ(experiment_json(second.experiment, second.paths), text);
    const json written = json::parse(text);
    for (const auto& [key, value] : file.items()) {
      EXPECT_TRUE(written.contains(key) || key == "level_by") << key << " of " << field;  // default
    }
    EXPECT_EQ(second.experiment.field.parts().size(), first.experiment.field.parts().size());
  }
}

TEST(ExperimentJson, WritesNothingThatIsNotStated) {
  Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field = GravityField();
  const json written = json::parse(experiment_json(experiment));
  EXPECT_EQ(written.size(), 4U);  // members: format, version, instrument, field
}

TEST(ParseExperiment, SuggestsTheNearKey) {
  json file = whole_experiment();
  file["feild"] = 1;
  EXPECT_THAT(experiment_complaint(file),
              HasSubstr("dir/e.json: /feild: unknown key; did you mean 'field'?"));
  file = whole_experiment();
  file["instrument"]["axis"] = json::array();
  EXPECT_THAT(experiment_complaint(file),
              HasSubstr("/instrument/axis: unknown key; did you mean 'axes'?"));
}

TEST(ParseExperiment, RefusesWrongValues) {
  const auto changed = [](const char* pointer, const json& value) {
    json file = whole_experiment();
    file[json::json_pointer(pointer)] = value;
    return experiment_complaint(file);
  };
  EXPECT_THAT(changed("/version", 3), HasSubstr("/version"));
  EXPECT_THAT(changed("/instrument/kind", "compass"), HasSubstr("/instrument/kind"));
  EXPECT_THAT(changed("/instrument", "accelerometer"), HasSubstr("/instrument: must be an object"));
  EXPECT_THAT(changed("/instrument/convention", "ned"), HasSubstr("/instrument/convention"));
  EXPECT_THAT(changed("/field/kind", "tides"), HasSubstr("/field/kind: unknown field"));
  EXPECT_THAT(changed("/field/in_table", {1, 2}), HasSubstr("/field/in_table: must have 3"));
  EXPECT_THAT(changed("/site/latitude_deg", 91), HasSubstr("/site: site: latitude"));
  EXPECT_THAT(changed("/table/slope", "flat"), HasSubstr("/table/slope"));
  EXPECT_THAT(changed("/table/slope", {2, 0}), HasSubstr("/table/slope: X^2 + Y^2"));
  EXPECT_THAT(changed("/instrument/axes", json::array()), HasSubstr("/instrument/axes: "));
  EXPECT_THAT(changed("/instrument/axes", {"x", "x"}), HasSubstr("/instrument/axes: "));
  EXPECT_THAT(changed("/field/magnitude", -1), HasSubstr("/field/magnitude: must be positive"));
  EXPECT_THAT(changed("/field/unit", "furlong"),
              HasSubstr("/field/unit: field gravity: the unit must be g or m/s^2"));
  EXPECT_THAT(changed("/field/in_table", {0, 0, 0}), HasSubstr("/field/in_table: must not be"));
  EXPECT_THAT(changed("/site/date", "rubbish"), HasSubstr("/site/date: must be a date"));
  EXPECT_THAT(changed("/method", "best"), HasSubstr("/method"));
  EXPECT_THAT(changed("/weights", 1), HasSubstr("/weights: must be a string"));
  EXPECT_THAT(changed("/leave_out", {1.5}), HasSubstr("/leave_out/0: must be a whole number"));
  EXPECT_THAT(changed("/positioner", "none.json"), HasSubstr("dir/none.json: no such file"));
  EXPECT_THAT(changed("/observations", {{"a", 1}}), HasSubstr("/observations"));
}

TEST(ParseExperiment, TakesTheLimitsRelativeToItself) {
  json file = whole_experiment();
  file["limits"] = "l.json";
  EXPECT_EQ(parse_experiment(file.dump(), "dir/e.json").paths.limits, "dir/l.json");
  file["limits"] = 3;
  EXPECT_THAT(experiment_complaint(file), HasSubstr("/limits"));
}

TEST(MakeFieldDescription, FindsTheMagnitude) {
  Experiment experiment;
  experiment.instrument.kind = "accelerometer";
  experiment.field.of = make_field("gravity");
  EXPECT_EQ(make_field_description(experiment).magnitude, 1.0);
  EXPECT_EQ(make_field_description(experiment).unit, "g");
  experiment.field.in_table = Eigen::Vector3d(0.0, 3.0, 4.0);
  EXPECT_EQ(make_field_description(experiment).magnitude, 5.0);
  experiment.field.magnitude = 6.0;
  EXPECT_EQ(make_field_description(experiment).magnitude, 6.0);
  const auto field = [](const char* kind, const char* unit) {
    FieldSetup setup(make_field(kind));
    setup.unit = unit;
    return setup;
  };
  experiment.field = field("gravity", "m/s^2");
  EXPECT_THROW(static_cast<void>(make_field_description(experiment)), SetupError);
  experiment.table.site = Site{.latitude_deg = 90.0};
  EXPECT_NEAR(make_field_description(experiment).magnitude, 9.8321849379, 1e-9);
  experiment.field = field("custom", "nT");
  EXPECT_THROW(static_cast<void>(make_field_description(experiment)), SetupError);
  experiment.field.unit = "";
  EXPECT_EQ(make_field_description(experiment).magnitude, 1.0);
  experiment.table = {};
  EXPECT_THROW(static_cast<void>(make_field("gravty")), SetupError);
  for (const char* kind : {"", "geomagnetic"}) {
    experiment.field = field(kind, "");
    EXPECT_THROW(static_cast<void>(make_field_description(experiment)), SetupError);
  }
  experiment.field = field("gravity", "ft/s^2");
  EXPECT_THROW(static_cast<void>(make_field_description(experiment)), SetupError);
}

TEST(MakeFieldDescription, TiltsTheFieldByTheKnownSlope) {
  Experiment experiment;
  experiment.field.of = make_field("gravity");
  experiment.table.slope = {0.01, -0.02};
  experiment.table.fence_azimuth_rad = 1.0;
  const Eigen::Vector3d in_table = *make_field_description(experiment).in_table;
  EXPECT_MATRIX_NEAR(in_table, Eigen::Vector3d(0.01, -0.02, std::sqrt(1.0 - 5e-4)), 1e-15);
  experiment.table.slope = {1.0, 0.1};
  EXPECT_THROW(static_cast<void>(make_field_description(experiment)), SetupError);
}

TEST(ChooseMethod, FollowsTheContract) {
  const SensorModel truth = test::accelerometer_truth();
  Experiment experiment = test::experiment_for(truth);
  const Observations twelve = test::observe(truth, {});
  EXPECT_EQ(choose_method(experiment, twelve), Method::joint);
  EXPECT_EQ(choose_method(experiment, test::observe(truth, {.points = 6})), Method::joint);
  experiment.field.in_table = Eigen::Vector3d(0.0, 0.1, 1.0);
  EXPECT_EQ(choose_method(experiment, twelve), Method::joint);
  experiment.fit.method = Method::known;
  EXPECT_EQ(choose_method(experiment, twelve), Method::known);
  experiment.fit.method.reset();
  Observations with_field = twelve;
  for (Reading& reading : with_field.readings) {
    reading.field_in_sensor = Eigen::Vector3d::UnitZ();
  }
  EXPECT_EQ(choose_method(experiment, with_field), Method::known);
}

TEST(FieldDescription, IsWorkedOutForEachKind) {
  for (const FieldKind& kind : field_kinds()) {
    Experiment experiment;
    experiment.field.of = make_field(kind.name);
    experiment.field.in_table = Eigen::Vector3d(0.0, 3.0, 4.0);
    const FieldDescription field = make_field_description(experiment);
    EXPECT_EQ(field.kind, kind.name);
    EXPECT_EQ(field.unit, kind.units.empty() ? "1" : kind.units.front());
    EXPECT_EQ(*field.in_table, *experiment.field.in_table) << kind.name;
    EXPECT_EQ(field.magnitude, 5.0) << kind.name;
  }
}

}  // namespace
}  // namespace axiscal
