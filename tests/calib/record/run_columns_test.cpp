// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/run_columns.hpp"

#include "axiscal/core/error.hpp"
#include "matchers.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;

TEST(RunColumns, MakeTheReadingsOfARun) {
  RunColumns columns;
  columns.rest = {"-Z", "+X"};
  columns.fence = {"+X", "-Y"};
  columns.block = Eigen::Vector2i(1, 2);
  columns.temperature = Eigen::Vector2d(20.0, 21.5);
  const Eigen::MatrixXd response = Eigen::MatrixXd::Random(2, 3);
  const axiscal::Run run = make_run(columns, response);
  EXPECT_EQ(run.observations.response, response);
  ASSERT_EQ(run.observations.readings.size(), 2U);
  const Reading& second = run.observations.readings[1];
  EXPECT_EQ(second.run, 2);
  EXPECT_EQ(second.block, 2);
  EXPECT_EQ(second.point, DesignPoint(*parse_face("+X"), *parse_face("-Y")));
  EXPECT_EQ(second.temperature->of(0), 21.5);
  EXPECT_TRUE(run.observations.has_block);
  EXPECT_FALSE(run.observations.has_level);
}

TEST(RunColumns, MistakesNameTheColumn) {
  const Eigen::MatrixXd response = Eigen::MatrixXd::Zero(2, 3);
  const auto complaint = [&](const RunColumns& columns) {
    try {
      static_cast<void>(make_run(columns, response));
    } catch (const DomainError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  RunColumns columns;
  columns.rest = {"-Z", "up"};
  EXPECT_THAT(complaint(columns), HasSubstr("fence: expected 2 values"));
  columns.fence = {"+X", "-X"};
  EXPECT_THAT(complaint(columns), HasSubstr("rest: 'up' in reading 2"));
  columns.rest = {"-Z", "-Z"};
  columns.level = Eigen::VectorXd::Zero(3);
  EXPECT_THAT(complaint(columns), HasSubstr("level: expected 2 values (one per reading), not 3"));
}

}  // namespace
}  // namespace axiscal::test
