// SPDX-License-Identifier: Apache-2.0
#include "axiscal/instruments/instrument.hpp"

#include "axiscal/core/error.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

TEST(NominalAxis, IsToldByTheNameElseByThePosition) {
  const Instrument named{.kind = "generic", .axes = {"acc_z", "aX"}};
  EXPECT_EQ(nominal_axis(named, 0), 2);
  EXPECT_EQ(nominal_axis(named, 1), 0);
  const Instrument three{.kind = "generic", .axes = {"a1", "a2", "a3"}};
  EXPECT_EQ(nominal_axis(three, 1), 1);
  const Instrument two{.kind = "generic", .axes = {"a1", "a2"}};
  EXPECT_FALSE(nominal_axis(two, 0));
}

TEST(FindInstrumentKind, KnowsItsKinds) {
  EXPECT_EQ(find_instrument_kind("accelerometer").derived_names.size(), 3U);
  EXPECT_EQ(find_instrument_kind("generic").derive, nullptr);
  EXPECT_EQ(instrument_kinds().size(), 6U);
  EXPECT_THROW(static_cast<void>(find_instrument_kind("thermometer")), DomainError);
}

TEST(InstrumentKind, LeavesRollOrYawEmpty) {
  const InstrumentKind& kind = find_instrument_kind("inclinometer");
  const DerivedValues level = kind.derive({.field_in_sensor = {0.0, 0.0, 1.0}});
  EXPECT_EQ(level.values[1], 0.0);
  EXPECT_TRUE(std::isnan(level.values[2]));
  const DerivedValues steep = kind.derive({.field_in_sensor = {1.0, 0.0, 0.0}});
  EXPECT_DOUBLE_EQ(steep.values[0], 90.0);
  EXPECT_TRUE(std::isnan(steep.values[1]));
  EXPECT_EQ(steep.values[2], 0.0);
}

TEST(LinearResponse, IsBiasAndSensitivity) {
  LinearResponse response{.bias = Eigen::Vector2d(1.0, 2.0),
                          .sensitivity = SensitivityMatrix::Zero(2, 3)};
  response.sensitivity << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  EXPECT_EQ(response.at({1.0, 0.0, -1.0}), Eigen::VectorXd(Eigen::Vector2d(-1.0, 0.0)));
}

}  // namespace
}  // namespace axiscal
