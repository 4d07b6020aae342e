// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reduction.hpp"

#include <cmath>
#include <cstring>

#include <Eigen/Geometry>

#include "allocations.hpp"
#include "axiscal/calib/reduction_csv.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/random.hpp"
#include "matchers.hpp"
#include "program.hpp"
#include "scenario.hpp"

namespace axiscal {
namespace {

using test::accelerometer_truth;

SensorModel truth_with_axes(int m, const std::string& kind) {
  LinearResponse response{.bias = Eigen::VectorXd::LinSpaced(m, -0.2, 0.3),
                          .sensitivity = SensitivityMatrix::Zero(m, 3)};
  for (int k = 0; k < m; ++k) {
    response.sensitivity.row(k) << 0.1 * k, -0.03, 0.2;
    response.sensitivity(k, k % 3) += 2.0 + 0.1 * k;
  }
  return test::truth_of(response, kind);
}

// A matrix of readings gives the same fields as the readings one by one.
TEST(Reducer, ReducesMatricesAsSingleReadings) {
  SensorModel warm = truth_with_axes(4, "generic");
  warm.temperature = TemperatureResponse{.spans = {{.reference = 20.0, .low = -10.0, .high = 50.0}},
                                         .bias = 1e-3 * Eigen::MatrixXd::Ones(4, 1),
                                         .scale = Eigen::Vector4d(1e-3, -2e-3, 3e-3, 0.0)};
  for (const SensorModel& truth : {truth_with_axes(3, "accelerometer"), warm}) {
    const Reducer reducer(truth, {.magnitude = 1.0});
    RandomStream random(6);
    const auto m = static_cast<Eigen::Index>(reducer.axis_count());
    constexpr Eigen::Index n = 37;
    const Eigen::MatrixXd readings =
        Eigen::MatrixXd::NullaryExpr(n, m, [&] { return random.normal(); });
    const Eigen::VectorXd temperatures = Eigen::VectorXd::LinSpaced(n, 0.0, 40.0);
    const Eigen::MatrixX3d fields = reducer.needs_temperature()
                                        ? reducer.reduce_rows(readings, temperatures)
                                        : reducer.reduce_rows(readings);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::VectorXd v = readings.row(i);
      ReadingContext context;
      if (reducer.needs_temperature()) {
        context.temperature = temperatures(i);
      }
      const ReducedReading one =
          reducer.reduce(std::span(v.data(), static_cast<std::size_t>(m)), context);
      EXPECT_LT((fields.row(i).transpose() - one.field_in_sensor).norm(), 1e-14);
    }
    EXPECT_THROW(static_cast<void>(reducer.reduce_rows(readings.leftCols(2))), DomainError);
    EXPECT_THROW(static_cast<void>(reducer.reduce_rows(readings, temperatures.head(3))),
                 DomainError);
  }
}

TEST(Reducer, InvertsTheResponse) {
  RandomStream random(4);
  for (const int m : {3, 4, 6}) {
    const SensorModel truth = truth_with_axes(m, "generic");
    const Reducer reducer(truth);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d f = random.normals<3>();
      const Eigen::VectorXd v = truth.response.at(f);
      const ReducedReading reduced = reducer.reduce({v.data(), static_cast<std::size_t>(m)});
      EXPECT_MATRIX_NEAR(reduced.field_in_sensor, f, 1e-14);
      EXPECT_NEAR(reduced.residual, f.norm() - 1.0, 1e-14);
    }
  }
}

TEST(Reducer, RefusesReadingsThatAreNotItsAxes) {
  const Reducer reducer(truth_with_axes(4, "accelerometer"));
  EXPECT_NO_THROW(static_cast<void>(reducer.reduce(std::array{0.1, 0.2, 0.3, 0.4})));
  EXPECT_THROW(static_cast<void>(reducer.reduce(std::array{0.1, 0.2, 0.3})), DomainError);
  EXPECT_THROW(static_cast<void>(reducer.reduce(std::vector<double>(5, 0.1))), DomainError);
  const Reducer two_axes(truth_with_axes(2, "accelerometer"));
  EXPECT_THROW(static_cast<void>(two_axes.reduce(std::array{0.1, 0.2})), DomainError);
}

TEST(Reducer, WeighsSpareAxesByTheirScatter) {
  Calibration record;
  record.sensor = truth_with_axes(4, "generic");
  SensorModel& truth = record.sensor;
  truth.response.sensitivity.setZero();
  truth.response.sensitivity.topRows<3>().setIdentity();
  truth.response.sensitivity(3, 0) = 1.0;  // a second axis along x, with three times the noise
  truth.response.bias.setZero();
  record.fit.statistics = FitStatistics{.residual_sd = Eigen::Vector4d(1.0, 1.0, 1.0, 3.0)};
  const ReducedReading reduced = Reducer(record).reduce(std::array{1.0, 0.0, 0.0, 2.0});
  // The weights are 1 and 1/9, so the mean is (1 + 2/9) / (1 + 1/9).
  EXPECT_NEAR(reduced.field_in_sensor.x(), 1.1, 1e-15);
}

TEST(Reducer, GivesAnglesForEachKind) {
  const SensorModel truth = accelerometer_truth();
  const Reducer reducer(truth);
  const Eigen::VectorXd v = truth.response.at({0.5, 0.0, std::sqrt(0.75)});
  const ReducedReading reduced = reducer.reduce({v.data(), 3});
  EXPECT_NEAR(reduced.derived.values[0], 30.0, 1e-12);
  EXPECT_NEAR(reduced.derived.values[1], 0.0, 1e-12);
  EXPECT_TRUE(std::isnan(reduced.derived.values[2]));
  // If gravity is stronger at the place of the reading, the same reading gives a smaller pitch.
  const ReducedReading elsewhere = Reducer(truth, {.magnitude = 1.002}).reduce({v.data(), 3});
  EXPECT_NEAR(elsewhere.residual, -0.002, 1e-14);
  EXPECT_NEAR(elsewhere.derived.values[0], std::asin(0.5 / 1.002) * deg_per_rad, 1e-12);
}

TEST(Reducer, GivesEachAxisWithFewerThanThree) {
  for (const int m : {1, 2}) {
    const SensorModel truth = truth_with_axes(m, "inclinometer");
    const Reducer reducer(truth);
    EXPECT_FALSE(reducer.gives_components());
    const Eigen::Vector3d f(0.4, -0.3, std::sqrt(0.75));
    const Eigen::VectorXd v = truth.response.at(f);
    for (int k = 0; k < m; ++k) {
      const Eigen::Vector3d axis = truth.response.sensitivity.row(k).normalized();
      const ReducedAxis reduced = reducer.reduce_axis(static_cast<std::size_t>(k), v(k));
      EXPECT_NEAR(reduced.component, axis.dot(f), 1e-15);
      EXPECT_NEAR(reduced.angle_rad, std::asin(axis.dot(f)), 1e-15);
      EXPECT_FALSE(reduced.clamped);
      EXPECT_TRUE(reducer.reduce_axis(static_cast<std::size_t>(k), 100.0).clamped);
    }
  }
}

// A sun sensor with two axes. The third component follows from the length of the field, because the
// sun is in front of the sensor.
TEST(Reducer, ClosesTwoAxesOfASunSensorByTheMagnitude) {
  SensorModel truth = truth_with_axes(2, "optical");
  const Reducer reducer(truth);
  ASSERT_TRUE(reducer.completes_third_component());
  const Eigen::Vector3d across = Eigen::Vector3d(truth.response.sensitivity.row(0))
                                     .cross(Eigen::Vector3d(truth.response.sensitivity.row(1)));
  for (Eigen::Vector3d f : {Eigen::Vector3d(0.3, -0.2, 0.9), Eigen::Vector3d(-0.5, 0.4, 0.7)}) {
    f = std::copysign(truth.field.magnitude, f.dot(across)) * f.normalized();
    const Eigen::VectorXd v = truth.response.at(f);
    const Reducer::ClosedField closed = reducer.closed_field(v(0), v(1));
    EXPECT_MATRIX_NEAR(closed.in_sensor, f, 1e-12);
    EXPECT_FALSE(closed.clamped);
  }
  EXPECT_TRUE(reducer.closed_field(50.0, 50.0).clamped);
  EXPECT_THROW(static_cast<void>(Reducer(accelerometer_truth()).closed_field(0.0, 0.0)),
               DomainError);
}

TEST(Reducer, AllocatesNothingPerReading) {
  const SensorModel truth = accelerometer_truth();
  const Reducer reducer(truth);
  const Reducer spare(truth_with_axes(6, "inclinometer"));
  const std::array<double, 6> v = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const std::size_t before = test::allocation_count();
  double sum = 0.0;
  for (int i = 0; i < 1000; ++i) {
    sum += reducer.reduce(std::span(v).first(3)).residual + spare.reduce(v).residual;
  }
  EXPECT_EQ(test::allocation_count(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(Reducer, RejectsWhatCannotBeInverted) {
  SensorModel truth = accelerometer_truth();
  EXPECT_THROW(Reducer(truth, {.magnitude = 0.0}), DomainError);
  truth.response.sensitivity.row(2) = truth.response.sensitivity.row(1);
  EXPECT_THROW(Reducer{truth}, DomainError);
  truth.response.sensitivity.row(2).setZero();
  EXPECT_THROW(Reducer{truth}, DomainError);
}

// ---- tables ----

struct Reduced {
  std::string text;
  ReductionCsvSummary summary;
  std::size_t blocks = 0;
  std::size_t allocations = 0;
};

Reduced reduce(const SensorModel& truth,
               const std::string& text,
               const ReductionCsvOptions& options = {}) {
  std::size_t at = 0;
  CsvReader csv(
      [&](char* buffer, std::size_t size) {
        const std::size_t count = std::min(size, text.size() - at);
        std::memcpy(buffer, text.data() + at, count);
        at += count;
        return count;
      },
      "in.csv");
  Reduced result;
  result.text.reserve(8 * text.size() + 10000);
  const Reducer reducer(truth);
  const std::size_t before = test::allocation_count();
  result.summary = reduce_csv(csv, reading_columns(truth.instrument), reducer, options,
                              [&](std::string_view block) {
                                result.text += block;
                                ++result.blocks;
                              });
  result.allocations = test::allocation_count() - before;
  return result;
}

TEST(ReduceCsv, CopiesCellsAndAppendsResults) {
  const SensorModel truth = accelerometer_truth();
  const Eigen::VectorXd v = truth.response.at({0.0, 0.0, 1.0});
  char row[200];
  std::snprintf(row, sizeof row, "a \"b\",x,z,y\n\" q,1\" , %.17g,%.17g,%.17g\r\n", v(0), v(2),
                v(1));
  const Reduced reduced = reduce(truth, "t,x,z,y\r\n" + std::string(row).substr(12));
  const std::vector<std::vector<std::string>> rows = test::csv_cells(reduced.text);
  EXPECT_EQ(reduced.text.substr(0, reduced.text.find('\n')),
            "t,x,z,y,field_x,field_y,field_z,residual,pitch_deg,roll_deg,yaw_deg,flag");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_TRUE(reduced.text.find("\" q,1\" , ") != std::string::npos) << "cells stay as they are";
  EXPECT_EQ(reduced.text.back(), '\n');
  EXPECT_EQ(reduced.text.find('\r'), std::string::npos);
  const std::vector<std::string>& cells = rows[1];  // one cell more by the quoted comma
  EXPECT_NEAR(std::stod(cells[7]), 1.0, 1e-15);
  EXPECT_EQ(cells[11], "") << "no yaw";
  EXPECT_EQ(cells[12], "") << "no flag";
}

TEST(ReduceCsv, WritesSoManyDecimals) {
  const SensorModel truth = accelerometer_truth();
  const Eigen::VectorXd v = truth.response.at({0.6, 0.0, 0.8});
  char row[200];
  std::snprintf(row, sizeof row, "%.17g,%.17g,%.17g\n", v(0), v(1), v(2));
  ReductionCsvOptions options;
  options.decimals = 3;
  const Reduced reduced = reduce(truth, "x,y,z\n" + std::string(row), options);
  EXPECT_TRUE(reduced.text.find(",0.600,0.000,0.800,0.000,36.870,") != std::string::npos)
      << reduced.text;
}

TEST(ReduceCsv, KeepsThePlaceOfRowsThatCannotBeReduced) {
  const SensorModel truth = accelerometer_truth();
  const std::string text =
      "x,y,z,n\n0,0,2.5,a\nnan,0,2.5,b\n0,0\n0,0,2.5,c,extra\n,,,d\n0,0,\"2.5,e\n1e308,1e308,1e308,"
      "f\n"
      "0,0,9,g\n";
  const Reduced reduced = reduce(truth, text);
  const std::vector<std::vector<std::string>> rows = test::csv_cells(reduced.text);
  ASSERT_EQ(rows.size(), 9U);
  EXPECT_EQ(reduced.summary.rows, 8U);
  EXPECT_EQ(reduced.summary.unreadable, 6U);
  EXPECT_EQ(reduced.summary.first_unreadable_line, 3U);
  EXPECT_EQ(rows[1].back(), "");
  for (const std::size_t i : {2U, 3U, 4U, 5U, 6U, 7U}) {
    EXPECT_EQ(rows[i].back(), "unreadable") << i;
    EXPECT_EQ(rows[i][rows[i].size() - 2], "") << i;
  }
  EXPECT_EQ(rows[2][3], "b");
  EXPECT_EQ(rows[3].size(), 12U) << "a short row is filled up";
  EXPECT_EQ(rows[4].size(), 13U) << "a long row keeps its cells";
  EXPECT_EQ(rows[8].back(), "") << "f_z alone is no argument of asin";
  for (const std::vector<std::string>& row : rows) {
    for (const std::string& cell : row) {
      EXPECT_TRUE(cell != "nan" || &row == &rows[2]) << "never NaN";
    }
  }
}

TEST(ReduceCsv, FlagsClampedRows) {
  const SensorModel truth = accelerometer_truth();
  const Reduced reduced = reduce(truth, "x,y,z\n2.6,0,0\n");
  const std::vector<std::vector<std::string>> rows = test::csv_cells(reduced.text);
  EXPECT_EQ(rows[1][7], "90");
  EXPECT_EQ(rows[1].back(), "clamped");
  EXPECT_EQ(reduced.summary.clamped, 1U);
}

TEST(ReduceCsv, StopsWhereAsked) {
  const SensorModel truth = accelerometer_truth();
  try {
    static_cast<void>(reduce(truth, "x,y,z\n1,2,3\n1,2,\n", {.strict = true}));
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("in.csv:3: column 'z': '' is not a finite"));
  }
  EXPECT_THROW(static_cast<void>(reduce(truth, "x,y,z\n1,2\n", {.strict = true})), DataError);
}

TEST(ReduceCsv, NeedsItsColumnsAndDoesNotWriteThemTwice) {
  const SensorModel truth = accelerometer_truth();
  EXPECT_THROW(static_cast<void>(reduce(truth, "x,y\n1,2\n")), DataError);
  EXPECT_THROW(static_cast<void>(reduce(truth, "x,y,z,pitch_deg\n1,2,3,4\n")), DataError);
}

TEST(ReduceCsv, GivesComponentsOfFewerAxes) {
  const SensorModel truth = truth_with_axes(2, "inclinometer");
  const Reduced reduced = reduce(truth, "x,y\n0.1,0.2\n9,0\n");
  const std::vector<std::vector<std::string>> rows = test::csv_cells(reduced.text);
  EXPECT_THAT(rows[0], testing::ElementsAre("x", "y", "component_x", "component_y", "angle_x_deg",
                                            "angle_y_deg", "flag"));
  const Reducer reducer(truth);
  EXPECT_EQ(std::stod(rows[1][3]), reducer.reduce_axis(1, 0.2).component);
  EXPECT_EQ(std::stod(rows[1][4]), reducer.reduce_axis(0, 0.1).angle_rad * deg_per_rad);
  EXPECT_EQ(rows[2].back(), "clamped");
  SensorModel faint = truth_with_axes(1, "inclinometer");
  faint.response.sensitivity *= 1e-3;
  EXPECT_EQ(test::csv_cells(reduce(faint, "x\n1e308\n").text)[1].back(), "unreadable");
  const Reduced generic = reduce(truth_with_axes(1, "generic"), "x\n0.1\n");
  EXPECT_EQ(generic.text.substr(0, generic.text.find('\n')), "x,component_x,flag");
}

TEST(ReduceCsv, AllocatesNothingPerRow) {
  const SensorModel truth = accelerometer_truth();
  const auto text = [](int rows) {
    std::string table = "t,x,y,z\n";
    for (int i = 0; i < rows; ++i) {
      table += i % 10 == 0 ? "\"a,b\",0.1,0.2,2.5\n" : "17,0.1,0.2,2.5\n";
    }
    return table;
  };
  const Reduced few = reduce(truth, text(1000));
  const Reduced many = reduce(truth, text(20000));
  constexpr double per_row = 0.2;  // allocations of a block, divided by its rows
  EXPECT_LT(static_cast<double>(many.allocations - few.allocations), per_row * 19000.0);
}

// Rows are reduced in groups. Each row gives the same numbers as Reducer::reduce() for its reading.
TEST(ReduceCsv, SaysWhatSingleReadingsSay) {
  RandomStream random(47);
  for (const std::string kind : {"accelerometer", "magnetometer", "generic"}) {
    for (const AxisConvention convention :
         {AxisConvention::forward_left_up, AxisConvention::forward_right_down}) {
      SensorModel truth = truth_with_axes(3, kind);
      truth.instrument.convention = convention;
      const Reducer reducer(truth);
      std::vector<std::array<double, 3>> readings;
      std::string text = "x,y,z\n";
      for (int i = 0; i < 700; ++i) {
        const Eigen::VectorXd v = truth.response.at(random.normals<3>().normalized());
        readings.push_back({v(0), v(1), v(2)});
        text += number_text(v(0)) + ',' + number_text(v(1)) + ',' + number_text(v(2)) + '\n';
        text += i % 100 == 50 ? "0.1,no number,0.2\n" : "";
      }
      const std::vector<std::vector<std::string>> cells = test::csv_cells(reduce(truth, text).text);
      ASSERT_EQ(cells.size(), 1 + 700 + 7U);
      std::size_t row = 0;
      for (const std::array<double, 3>& reading : readings) {
        ++row;
        row += cells[row].back() == "unreadable" ? 1U : 0U;
        const ReducedReading one = reducer.reduce(reading);
        for (std::size_t c = 3; c + 1 < cells[row].size(); ++c) {
          const std::string& name = cells[0][c];
          const double value =
              one[name.starts_with("field_") ? name.substr(name.size() - 1) : name];
          ASSERT_EQ(cells[row][c].empty(), std::isnan(value)) << kind << ' ' << row << ' ' << name;
          if (!std::isnan(value)) {
            EXPECT_NEAR(std::stod(cells[row][c]), value, 1e-11)
                << kind << ' ' << row << ' ' << name;
          }
        }
      }
    }
  }
}

// The output by parallel blocks is identical to the output row by row.
TEST(ReduceCsv, GivesTheSameAsRowByRow) {
  const SensorModel truth = accelerometer_truth();
  std::string text = "t,x,y,z\r\n";
  for (int i = 0; i < 40000; ++i) {
    const std::string number = std::to_string(1e-5 * i);
    text += i % 9973 == 11     ? "\"open,0.1,0.2,2.5\n"
            : i % 7919 == 5000 ? "short,0.1\n"
            : i % 3001 == 2    ? "# a comment\n\n"
            : i / 1000 == 33   ? "\"two\nlines\"," + number + ",0.2,2.5\n"
            : i % 2500 == 2499 ? "clamped,9," + number + ",-0.3\n"
            : i % 4001 == 4000 ? "large,1e308,-1e308,1e308\n"
                               : "plain," + number + ",0.2,2.5\r\n";
  }
  const Reduced by_rows = reduce(truth, text, {.every_row = true});
  const Reduced by_blocks = reduce(truth, text);
  EXPECT_TRUE(by_rows.text == by_blocks.text);
  EXPECT_LT(by_blocks.blocks, 100U);
  EXPECT_EQ(by_rows.summary.rows, by_blocks.summary.rows);
  EXPECT_EQ(by_rows.summary.unreadable, by_blocks.summary.unreadable);
  EXPECT_GT(by_blocks.summary.unreadable, 4U);
  EXPECT_EQ(by_rows.summary.first_unreadable_line, by_blocks.summary.first_unreadable_line);
  EXPECT_EQ(by_rows.summary.clamped, by_blocks.summary.clamped);
  EXPECT_EQ(by_rows.summary.far_from_field, by_blocks.summary.far_from_field);
  // The error names the line of the first row that cannot be reduced, even if it is far from the
  // start.
  const std::string late = "x,y,z\n" + [] {
    std::string rows;
    for (int i = 0; i < 100000; ++i) {
      rows += "0.1,0.2,2.5\n";
    }
    return rows;
  }() + "0.1,0.2,\n";
  try {
    static_cast<void>(reduce(truth, late, {.strict = true}));
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("in.csv:100002: column 'z'"));
  }
}

TEST(ReduceCsv, WritesBinaryRows) {
  const SensorModel truth = accelerometer_truth();
  const std::string text = "t,x,y,z\na,0.1,0.2,2.5\nb,9,0,0\nc,,,\n";
  const std::vector<std::vector<std::string>> cells = test::csv_cells(reduce(truth, text).text);
  const std::string rows = reduce(truth, text, {.form = ReductionForm::npy}).text;
  constexpr std::size_t numbers = 7;
  constexpr std::size_t row = 8 * numbers + 1;
  ASSERT_EQ(rows.size(), 3 * row);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < numbers; ++j) {
      double value = 0.0;
      std::memcpy(&value, rows.data() + i * row + 8 * j, sizeof value);
      const std::string& cell = cells[i + 1][4 + j];
      EXPECT_TRUE(cell.empty() ? std::isnan(value) : value == std::stod(cell)) << i << ' ' << j;
    }
  }
  EXPECT_EQ(rows[row - 1], 0);
  EXPECT_EQ(rows[2 * row - 1], static_cast<char>(reduction_flag::clamped));
  EXPECT_EQ(rows[3 * row - 1], static_cast<char>(reduction_flag::unreadable));
  const Reducer reducer(truth);
  const auto header = [&](std::size_t count) {
    return reduction_npy_header(reading_columns(truth.instrument), reducer,
                                {.form = ReductionForm::npy}, count);
  };
  EXPECT_EQ(header(0).size() % 64, 0U);
  EXPECT_EQ(header(0).size(), header(1000000000000).size());
  EXPECT_THAT(header(3), testing::HasSubstr("('pitch_deg', '<f8')"));
  EXPECT_THAT(header(3),
              testing::HasSubstr("('flag', '|u1')], 'fortran_order': False, 'shape': (3,)"));
}

TEST(ReduceCsv, HandsOverEachRowOnRequest) {
  const SensorModel truth = accelerometer_truth();
  const std::string text = "x,y,z\n1,2,3\n1,2,3\n1,2,3\n";
  EXPECT_EQ(reduce(truth, text).blocks, 2U) << "the header, and the rows";
  EXPECT_EQ(reduce(truth, text, {.every_row = true}).blocks, 4U);
}

}  // namespace
}  // namespace axiscal
