// SPDX-License-Identifier: Apache-2.0
// NIST Statistical Reference Datasets, linear regression (https://www.itl.nist.gov/div898/strd/).
#include <cmath>
#include <fstream>
#include <sstream>

#include "axiscal/calib/least_squares.hpp"
#include "data.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

struct StrdSet {
  Eigen::MatrixXd columns;  // y and the predictors
  Eigen::VectorXd estimate;
  Eigen::VectorXd standard_deviation;
  double residual_sd = 0.0;
};

std::vector<double> numbers_in(const std::string& line) {
  std::vector<double> numbers;
  std::istringstream words(line);
  for (std::string word; words >> word;) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (end != word.c_str() && *end == '\0') {
      numbers.push_back(number);
    }
  }
  return numbers;
}

// The header of the file states the lines of the data: "Data   (lines 61 to 71)".
StrdSet read_strd(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
  }
  StrdSet set;
  std::size_t first = 0;
  std::size_t last = 0;
  std::vector<std::vector<double>> parameters;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    int from = 0;
    int to = 0;
    if (std::sscanf(lines[i].c_str(), " Data (lines %d to %d)", &from, &to) == 2) {
      first = static_cast<std::size_t>(from);
      last = static_cast<std::size_t>(to);
    }
    std::istringstream words(lines[i]);
    std::string name;
    words >> name;
    const std::vector<double> numbers = numbers_in(lines[i]);
    if (name.size() > 1 && name[0] == 'B' && numbers.size() == 2) {
      parameters.push_back(numbers);
    }
    if (lines[i].find("Standard Deviation") != std::string::npos && numbers.size() == 1) {
      set.residual_sd = numbers[0];
    }
  }
  const auto p = static_cast<Eigen::Index>(parameters.size());
  set.estimate.resize(p);
  set.standard_deviation.resize(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    set.estimate(j) = parameters[static_cast<std::size_t>(j)][0];
    set.standard_deviation(j) = parameters[static_cast<std::size_t>(j)][1];
  }
  for (std::size_t i = first - 1; i < last; ++i) {
    const std::vector<double> row = numbers_in(lines[i]);
    set.columns.conservativeResize(set.columns.rows() + 1, static_cast<Eigen::Index>(row.size()));
    set.columns.bottomRows(1) =
        Eigen::Map<const Eigen::RowVectorXd>(row.data(), static_cast<Eigen::Index>(row.size()));
  }
  return set;
}

// Number of digits that agree. If the certified value is 0, the absolute error is used.
double digits(const Eigen::VectorXd& actual, const Eigen::VectorXd& certified) {
  double fewest = 15.0;
  for (Eigen::Index j = 0; j < certified.size(); ++j) {
    double error = std::abs(actual(j) - certified(j));
    error /= certified(j) == 0.0 ? 1.0 : std::abs(certified(j));
    fewest = std::min(fewest, error == 0.0 ? 15.0 : -std::log10(error));
  }
  return fewest;
}

enum class Columns { predictors, intercept_and_predictors, powers };

struct Case {
  const char* name;
  Columns columns;
  double digits;
};

class NistStrd : public testing::TestWithParam<Case> {};

TEST_P(NistStrd, ReachesItsDigits) {
  const Case& c = GetParam();
  AXISCAL_NEED_DATA(path, std::string("nist_strd/") + c.name + ".dat");
  const StrdSet set = read_strd(path);
  ASSERT_GE(set.estimate.size(), 1);
  const Eigen::Index p = set.estimate.size();
  Eigen::MatrixXd X(set.columns.rows(), p);
  if (c.columns == Columns::powers) {
    for (Eigen::Index j = 0; j < p; ++j) {
      X.col(j) = set.columns.col(1).unaryExpr(
          [j](double x) { return std::pow(x, static_cast<double>(j)); });
    }
  } else {
    X.rightCols(set.columns.cols() - 1) = set.columns.rightCols(set.columns.cols() - 1);
    if (c.columns == Columns::intercept_and_predictors) {
      X.col(0).setOnes();
    }
  }
  const LeastSquaresDesign design(X);
  const LeastSquaresFit fit = design.fit(set.columns.col(0));
  const Eigen::VectorXd sd = fit.covariance.diagonal().cwiseSqrt();
  const double of_estimate = digits(fit.estimate, set.estimate);
  const double of_sd = digits(sd, set.standard_deviation);
  std::printf("%s: condition %.3g, digits of estimates %.2f, of their sd %.2f\n", c.name,
              design.condition_number(), of_estimate, of_sd);
  EXPECT_GE(of_estimate, c.digits);
  EXPECT_GE(of_sd, c.digits);
  EXPECT_GE(digits(Eigen::VectorXd::Constant(1, fit.residual_sd),
                   Eigen::VectorXd::Constant(1, set.residual_sd)),
            c.digits);
}

INSTANTIATE_TEST_SUITE_P(Linear,
                         NistStrd,
                         testing::Values(Case{"NoInt1", Columns::predictors, 13.0},
                                         Case{"Norris", Columns::intercept_and_predictors, 13.0},
                                         Case{"Longley", Columns::intercept_and_predictors, 12.0},
                                         Case{"Wampler1", Columns::powers, 13.0},
                                         Case{"Wampler2", Columns::powers, 13.0},
                                         Case{"Wampler4", Columns::powers, 8.0},
                                         Case{"Filip", Columns::powers, 7.0}),
                         [](const testing::TestParamInfo<Case>& test_case) {
                           return std::string(test_case.param.name);
                         });

}  // namespace
}  // namespace axiscal
