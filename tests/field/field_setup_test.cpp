// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_setup.hpp"

#include <gmock/gmock.h>

#include "axiscal/core/error.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/field/coil_field.hpp"
#include "axiscal/field/custom_field.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/geomagnetic_field.hpp"
#include "axiscal/field/gravity_field.hpp"
#include "axiscal/field/induced_field.hpp"
#include "axiscal/field/light_field.hpp"
#include "axiscal/field/recorded_field.hpp"
#include "axiscal/field/turntable_field.hpp"
#include "matchers.hpp"
#include "program.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

constexpr Site munich{.latitude_deg = 48.14, .longitude_deg = 11.58, .height_m = 520.0};

TEST(FieldSetup, TakesAFieldAsItIs) {
  FieldSetup setup = GeomagneticField(munich, 2026.5, "uT");
  const TablePlace elsewhere{.site = Site{.latitude_deg = -30.0}, .fence_azimuth_rad = 0.0};
  const FieldDescription found = resolve_field(setup, elsewhere, {}).front();
  EXPECT_EQ(found.unit, "uT");
  EXPECT_EQ(found.model, "wmm2025");
  EXPECT_MATRIX_NEAR(*found.in_table, GeomagneticField(munich, 2026.5, "uT").value_in_enu(), 1e-12);
  setup.magnitude = 48.0;  // a measured value
  EXPECT_NEAR(resolve_field(setup, elsewhere, {}).front().in_table->norm(), 48.0, 1e-12);
}

TEST(FieldSetup, SaysTheSameByItsClassAndByItsName) {
  const TablePlace place{.site = munich, .date = "2026.5", .fence_azimuth_rad = 0.4};
  FieldSetup named(make_field("geomagnetic"));
  named.unit = "nT";
  EXPECT_MATRIX_NEAR(*resolve_field(named, place, {}).front().in_table,
                     *resolve_field(GeomagneticField(munich, 2026.5), place, {}).front().in_table,
                     1e-9);
  FieldSetup gravity(make_field("gravity"));
  gravity.unit = "m/s^2";
  EXPECT_EQ(resolve_field(gravity, place, {}).front().magnitude,
            resolve_field(GravityField(munich), {}, {}).front().magnitude);
  FieldSetup induced = InducedField("induced_rotation", {0.0, 0.0, 90.0}, "deg/s");
  EXPECT_EQ(*resolve_field(induced, {}, {}).front().in_table, Eigen::Vector3d(0.0, 0.0, 90.0));
}

TEST(FieldSetup, AddsItsParts) {
  FieldSetup setup = GeomagneticField(munich, 2026.5, "uT");
  setup += CoilField();
  ASSERT_EQ(setup.parts().size(), 2U);
  const std::vector<FieldDescription> parts = resolve_field(setup, {}, {});
  EXPECT_FALSE(parts[0].set_by_level);
  EXPECT_TRUE(parts[1].set_by_level);
  EXPECT_TRUE(parts[1].free_length);
  EXPECT_EQ(parts[1].unit, "uT");  // the unit of the first part
}

// If nothing is stated about the room light, it is fitted beside the lamp, whose size is known.
TEST(FieldSetup, LeavesALocalPartOpenOfWhichNothingIsStated) {
  FieldSetup setup = LightField();
  setup.role = FieldRole::local;
  FieldSetup lamp = LightField();
  lamp.magnitude = 1.0;
  setup += lamp;
  EXPECT_TRUE(resolve_field(setup, {}, {})[0].free_length);
  setup.magnitude = 0.2;
  EXPECT_FALSE(resolve_field(setup, {}, {})[0].free_length);
  setup.magnitude.reset();
  setup.others.front().magnitude.reset();
  setup.others.front().magnitude_unknown = true;
  EXPECT_THAT(
      test::complaint_of<SetupError>([&] { static_cast<void>(resolve_field(setup, {}, {})); }),
      HasSubstr("the magnitude of at least one part must be known"));
}

TEST(FieldSetup, RefusesTwoPartsOfOneName) {
  FieldSetup setup = CoilField();
  setup.magnitude = 60.0;
  setup.name = "north";
  setup += setup;
  EXPECT_THAT(
      test::complaint_of<SetupError>([&] { static_cast<void>(resolve_field(setup, {}, {})); }),
      HasSubstr("two parts have the name 'north'"));
}

// A user's kind of field: the class, its entry, and the call that adds it.
class StormField final : public ReferenceField {
 public:
  Eigen::Vector3d value_in_enu() const override { return Eigen::Vector3d::Zero(); }
  std::string_view unit() const override { return "V/m"; }
  std::string_view kind() const override { return "storm"; }
  void resolve(FieldResolver& of) const override {
    of.set_given_magnitude(": its strength is not known; state it", {});
    of.set_direction(-Eigen::Vector3d::UnitZ(), false);
  }
};

TEST(AddFieldKind, IsStatedByItsName) {
  static constexpr std::array<std::string_view, 2> units = {"V/m", "kV/m"};
  add_field_kind({.name = "storm", .units = units, .local = true, .make = maker_of<StormField>()});
  FieldSetup setup(make_field("storm"));
  EXPECT_THAT(
      test::complaint_of<SetupError>([&] { static_cast<void>(resolve_field(setup, {}, {})); }),
      HasSubstr("its strength is not known"));
  setup.magnitude = 120.0;
  EXPECT_EQ(*resolve_field(setup, {}, {}).front().in_table, Eigen::Vector3d(0.0, 0.0, -120.0));
  setup.unit = "T";
  EXPECT_THROW(static_cast<void>(resolve_field(setup, {}, {})), SetupError);
  EXPECT_THROW(add_field_kind({.name = "storm"}), DomainError);
  EXPECT_THAT(test::complaint_of<SetupError>([] { static_cast<void>(make_field("strom")); }),
              HasSubstr("did you mean 'storm'"));
}

TEST(RecordedField, IsLinearBetweenItsTimesAndKnownNowhereElse) {
  const test::ScratchFolder folder;
  const std::string path = folder.write("field.csv", "time,bx,by,bz\n10,0,0,40\n20,4,0,50\n");
  const RecordedField field = read_recorded_field(path, make_field("geomagnetic"));
  EXPECT_MATRIX_NEAR(field.value_in_enu_at(12.5), Eigen::Vector3d(1.0, 0.0, 42.5), 1e-12);
  const Eigen::Matrix3d change = change_of_field(field, {}, 10.0, 20.0);
  EXPECT_MATRIX_NEAR(change * field.value_in_enu_at(10.0), field.value_in_enu_at(20.0), 1e-12);
  EXPECT_THAT(
      test::complaint_of<RefusedError>([&] { static_cast<void>(field.value_in_enu_at(21.0)); }),
      HasSubstr("is from time 10 to 20"));
  const auto complaint = [&](const char* text) {
    const std::string bad = folder.write("bad.csv", text);
    return test::complaint_of<DataError>(
        [&] { static_cast<void>(read_recorded_field(bad, make_field("light"))); });
  };
  EXPECT_THAT(complaint("time,x,y,z\n1,0,0,1\n1,0,0,1\n"),
              HasSubstr("must increase from row to row"));
  EXPECT_THAT(complaint("time,x,y,z\n1,0,0,1\n2,0,nought,1\n"), HasSubstr("bad.csv:3"));
  EXPECT_THAT(complaint("time,x,y\n1,0,0\n2,0,0\n"), HasSubstr("three more"));
}

}  // namespace
}  // namespace axiscal
