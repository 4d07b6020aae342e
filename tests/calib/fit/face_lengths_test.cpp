// SPDX-License-Identifier: Apache-2.0
// Bias and scale of an axis by the length of the field on six faces, compared with equations that
// are solved here.
#include "calib/fit/face_lengths.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "axiscal/core/rotation.hpp"
#include "calib/fit/method_fit.hpp"
#include "labelled_set.hpp"
#include "matchers.hpp"

namespace axiscal {
namespace {

constexpr double length_of_field = 9.81;

LinearResponse diagonal_response() {
  return {.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
          .sensitivity = Eigen::Vector3d(2.0, 2.2, 1.9).asDiagonal()};
}

// `times` readings on each of six faces. The cube leans by a separate random rotation in each
// reading.
ReadingSet leaning_set(int times,
                       double lean_rad,
                       double noise_sd,
                       std::uint64_t seed,
                       const LinearResponse& truth = diagonal_response()) {
  std::vector<DesignEntry> design;
  for (int t = 0; t < times; ++t) {
    for (const DesignEntry& entry : standard_design(6)) {
      design.push_back(entry);
    }
  }
  const TableField field = test::gravity_in_table(Eigen::Vector3d(0.0, 0.0, length_of_field));
  ReadingSet set = test::labelled_set(truth, field, design, 0.0, 1);
  RandomStream random(seed);
  for (std::size_t i = 0; i < design.size(); ++i) {
    const Eigen::Vector3d met = rotation_by(lean_rad * random.normals<3>()) *
                                (set.rotation_sensor_from_table[i] * field.vector(0));
    Eigen::VectorXd v = truth.at(met);
    for (double& one : v) {
      one += noise_sd * random.normal();
    }
    set.response.row(static_cast<Eigen::Index>(i)) = v;
  }
  return set;
}

Estimate fit_by_labels(const ReadingSet& set) {
  return method_fit(Method::faces).fitted(set, false);
}

struct FaceFit {
  bool fitted = false;
  Estimate estimate;
};

FaceFit fit_by_lengths(const ReadingSet& set) {
  FaceFit fit{.estimate = fit_by_labels(set)};
  fit.fitted = fit_face_lengths(set, length_of_field, fit.estimate);
  return fit;
}

// The length of the field in each reading by a response without cross-axis terms.
Eigen::VectorXd lengths_of_field(const ReadingSet& set, const LinearResponse& response) {
  const Eigen::Vector3d s = Eigen::Matrix3d(response.sensitivity).diagonal();
  Eigen::VectorXd lengths(set.size());
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    lengths(i) = (set.response.row(i).transpose() - response.bias).cwiseQuotient(s).norm();
  }
  return lengths;
}

double cost_of_lengths(const ReadingSet& set, const LinearResponse& response) {
  return (lengths_of_field(set, response).array() - length_of_field).square().sum();
}

// Adds `step` to one of six unknowns, in the order b_x, b_y, b_z, s_x, s_y, s_z.
LinearResponse moved_response(LinearResponse response, Eigen::Index unknown, double step) {
  if (unknown < 3) {
    response.bias(unknown) += step;
  } else {
    response.sensitivity(unknown - 3, unknown - 3) += step;
  }
  return response;
}

Eigen::MatrixXd length_jacobian(const ReadingSet& set, const LinearResponse& response) {
  constexpr double step = 1e-6;
  Eigen::MatrixXd J(set.size(), 6);
  for (Eigen::Index p = 0; p < 6; ++p) {
    J.col(p) = (lengths_of_field(set, moved_response(response, p, step)) -
                lengths_of_field(set, moved_response(response, p, -step))) /
               (2.0 * step);
  }
  return J;
}

TEST(FaceLengths, OfSixReadingsAreAllTheFields) {
  const ReadingSet set = leaning_set(1, 0.02, 1e-4, 1);
  const FaceFit fit = fit_by_lengths(set);
  ASSERT_TRUE(fit.fitted);
  EXPECT_MATRIX_NEAR(lengths_of_field(set, fit.estimate.response),
                     Eigen::VectorXd::Constant(6, length_of_field), 1e-9);
  // The cross-axis terms are 0, and a note reports this.
  const Eigen::Matrix3d S = fit.estimate.response.sensitivity;
  EXPECT_EQ((S - Eigen::Matrix3d(S.diagonal().asDiagonal())).norm(), 0.0);
  EXPECT_THAT(fit.estimate.notes,
              test::HasNote(testing::HasSubstr("do not determine the cross-axis terms")));
}

TEST(FaceLengths, OfManyReadingsAreLeastSquares) {
  const ReadingSet set = leaning_set(4, 0.01, 2e-3, 2);
  const FaceFit fit = fit_by_lengths(set);
  ASSERT_TRUE(fit.fitted);
  const double least = cost_of_lengths(set, fit.estimate.response);
  for (Eigen::Index p = 0; p < 6; ++p) {
    for (const double step : {1e-4, -1e-4}) {
      EXPECT_GT(cost_of_lengths(set, moved_response(fit.estimate.response, p, step)), least) << p;
    }
  }
  const Eigen::MatrixXd J = length_jacobian(set, fit.estimate.response);
  const Eigen::VectorXd r = lengths_of_field(set, fit.estimate.response).array() - length_of_field;
  EXPECT_LT((J.transpose() * r).norm(), 1e-6 * J.norm() * r.norm());
}

// The covariance is s^2 (J^T J)^-1, s from the lengths with n - 6 degrees of freedom. The effect of
// the lean is added at second order: half of the mean square lean, summed over the axes.
TEST(FaceLengths, StateTheirCovariance) {
  const ReadingSet set = leaning_set(4, 0.01, 2e-3, 3);
  const FaceFit fit = fit_by_lengths(set);
  ASSERT_TRUE(fit.fitted);
  const LinearResponse& found = fit.estimate.response;
  const FitStatistics& statistics = fit.estimate.statistics;
  const double sd = std::sqrt(cost_of_lengths(set, found) / 18.0);
  const Eigen::MatrixXd J = length_jacobian(set, found);
  const Eigen::MatrixXd C = sd * sd * (J.transpose() * J).inverse();
  const Eigen::Vector3d s = Eigen::Matrix3d(found.sensitivity).diagonal();
  // Mean square of an axis's field component on the four faces across the axis, divided by F^2.
  Eigen::Vector3d transverse = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Eigen::Vector3d f =
        (set.response.row(i).transpose() - found.bias).cwiseQuotient(s) / length_of_field;
    for (Eigen::Index k = 0; k < 3; ++k) {
      transverse(k) += std::abs(f(k)) < 0.5 ? f(k) * f(k) / 16.0 : 0.0;
    }
  }
  const double second = 0.5 * transverse.sum();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double of_lean = std::pow(s(k) * second, 2);
    EXPECT_NEAR(statistics.covariance(4 * k, 4 * k),
                C(k, k) + of_lean * length_of_field * length_of_field, 1e-4 * C(k, k));
    EXPECT_NEAR(statistics.covariance(5 * k + 1, 5 * k + 1), C(3 + k, 3 + k) + of_lean,
                1e-4 * C(3 + k, 3 + k));
    EXPECT_NEAR(statistics.covariance(4 * k, 5 * k + 1), C(k, 3 + k),
                1e-4 * std::sqrt(C(k, k) * C(3 + k, 3 + k)));
    // The sd of a cross-axis term is the rms component across the axis.
    const Eigen::Index cross = 4 * k + 1 + (k + 1) % 3;
    EXPECT_NEAR(statistics.covariance(cross, cross), s(k) * s(k) * transverse(k), 1e-9);
    EXPECT_NEAR(statistics.residual_sd(k), sd * s(k), 1e-9);
    EXPECT_EQ(statistics.degrees_of_freedom(k), 18.0);
  }
}

// The length of the field does not depend on the lean, so without cross-axis terms the lean has no
// effect.
TEST(FaceLengths, DoNotDependOnTheLean) {
  for (const double lean : {0.005, 0.02, 0.05}) {
    const FaceFit fit = fit_by_lengths(leaning_set(1, lean, 0.0, 4));
    ASSERT_TRUE(fit.fitted);
    EXPECT_MATRIX_NEAR(fit.estimate.response.bias, diagonal_response().bias, 1e-9);
    EXPECT_MATRIX_NEAR(fit.estimate.response.sensitivity, diagonal_response().sensitivity, 1e-9);
  }
}

// With cross-axis terms of t and faces that lean by t, the bias by labels is wrong by t F and the
// bias by lengths by t^2 F only.
TEST(FaceLengths, AreWrongAtSecondOrderOnly) {
  const auto errors_at = [](double t) {
    LinearResponse truth = diagonal_response();
    truth.sensitivity.row(0) += t * Eigen::RowVector3d(0.0, 2.0, -1.0);
    truth.sensitivity.row(1) += t * Eigen::RowVector3d(1.0, 0.0, 1.5);
    truth.sensitivity.row(2) += t * Eigen::RowVector3d(-2.0, 1.0, 0.0);
    const ReadingSet set = leaning_set(1, t, 0.0, 4, truth);
    return std::pair((fit_by_lengths(set).estimate.response.bias - truth.bias).norm(),
                     (fit_by_labels(set).response.bias - truth.bias).norm());
  };
  const auto [of_little, labels_of_little] = errors_at(0.002);
  const auto [of_more, labels_of_more] = errors_at(0.008);
  EXPECT_NEAR(of_more / of_little, 16.0, 2.0);
  EXPECT_NEAR(labels_of_more / labels_of_little, 4.0, 0.4);
  EXPECT_LT(10.0 * of_more, labels_of_more);
}

// The stated standard errors cover the errors of the biases in 60 runs of cubes that lean by 1
// degree.
TEST(FaceLengths, CoverTheErrorOfTheLean) {
  int covered = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    FaceFit fit = fit_by_lengths(leaning_set(4, 0.0175, 1e-3, seed));
    ASSERT_TRUE(fit.fitted);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double error = fit.estimate.response.bias(k) - diagonal_response().bias(k);
      covered +=
          std::abs(error) < 2.2 * std::sqrt(fit.estimate.statistics.covariance(4 * k, 4 * k));
    }
  }
  EXPECT_GE(covered, 160);  // out of 180
}

TEST(FaceLengths, TakeAnAxisThatIsReversedOrElsewhere) {
  LinearResponse truth{.bias = Eigen::Vector3d(0.1, -0.2, 0.3),
                       .sensitivity = Eigen::Matrix3d::Zero()};
  truth.sensitivity(0, 1) = -2.0;
  truth.sensitivity(1, 2) = 2.2;
  truth.sensitivity(2, 0) = 1.9;
  const FaceFit fit = fit_by_lengths(leaning_set(2, 0.0, 0.0, 5, truth));
  ASSERT_TRUE(fit.fitted);
  EXPECT_MATRIX_NEAR(fit.estimate.response.sensitivity, truth.sensitivity, 1e-10);
  EXPECT_MATRIX_NEAR(fit.estimate.response.bias, truth.bias, 1e-9);
}

TEST(FaceLengths, DoNotDependOnOrderOrUnit) {
  const ReadingSet set = leaning_set(3, 0.01, 1e-3, 6);
  const FaceFit fit = fit_by_lengths(set);
  ReadingSet other = set;
  std::reverse(other.readings.begin(), other.readings.end());
  other.response = 100.0 * set.response.colwise().reverse();
  other.rotation_sensor_from_table.clear();
  for (Eigen::Index i = set.size() - 1; i >= 0; --i) {
    other.rotation_sensor_from_table.push_back(
        set.rotation_sensor_from_table[static_cast<std::size_t>(i)]);
  }
  const FaceFit again = fit_by_lengths(other);
  ASSERT_TRUE(again.fitted);
  EXPECT_MATRIX_NEAR(again.estimate.response.bias, 100.0 * fit.estimate.response.bias, 1e-8);
  EXPECT_MATRIX_NEAR(again.estimate.response.sensitivity, 100.0 * fit.estimate.response.sensitivity,
                     1e-8);
  EXPECT_MATRIX_NEAR(again.estimate.statistics.covariance, 1e4 * fit.estimate.statistics.covariance,
                     1e-6);
}

// With two axes the length is unknown. Then bias and scale of an axis are half the sum and half the
// difference of its readings on its two faces.
ReadingSet of_two_axes(ReadingSet set) {
  set.response.conservativeResize(Eigen::NoChange, 2);
  set.weights.conservativeResize(Eigen::NoChange, 2);
  set.axes.resize(2);
  set.nominal.resize(2);
  return set;
}

TEST(FaceLengths, OfTwoAxesAreHalfSumAndHalfDifference) {
  ReadingSet set = of_two_axes(leaning_set(3, 0.01, 1e-3, 7));
  RandomStream random(8);
  for (double& weight : set.weights.reshaped()) {
    weight = 0.5 + random.uniform();
  }
  set.weights.col(0) /= set.weights.col(0).mean();
  set.weights.col(1) /= set.weights.col(1).mean();
  const FaceFit fit = fit_by_lengths(set);
  ASSERT_TRUE(fit.fitted);
  for (Eigen::Index k = 0; k < 2; ++k) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Vector2d weight = Eigen::Vector2d::Zero();
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const Eigen::Vector3d met =
          set.rotation_sensor_from_table[static_cast<std::size_t>(i)].col(2);
      if (std::abs(met(k)) > 0.5) {
        const Eigen::Index side = met(k) > 0.0 ? 0 : 1;
        sum(side) += set.weights(i, k) * set.response(i, k);
        weight(side) += set.weights(i, k);
      }
    }
    const Eigen::Vector2d mean = sum.cwiseQuotient(weight);
    const double s = (mean(0) - mean(1)) / (2.0 * length_of_field);
    EXPECT_NEAR(fit.estimate.response.bias(k), mean.mean(), 1e-10);
    EXPECT_NEAR(fit.estimate.response.sensitivity(k, k), s, 1e-10);
    // var b = F^2 var s = a quarter of the sum of both means' variances.
    const FitStatistics& statistics = fit.estimate.statistics;
    const double variance =
        std::pow(statistics.residual_sd(k), 2) * 0.25 * weight.cwiseInverse().sum();
    const double lean = statistics.covariance(4 * k, 4 * k) - variance;
    EXPECT_GT(lean, -1e-12);
    EXPECT_NEAR(statistics.covariance(5 * k + 1, 5 * k + 1),
                (variance + lean) / std::pow(length_of_field, 2), 1e-12);
  }
  EXPECT_EQ(fit.estimate.response.sensitivity(0, 2), 0.0);
}

TEST(FaceLengths, TakeAFewReadingsScatterFromTheLabels) {
  const ReadingSet set = leaning_set(1, 0.01, 1e-3, 9);
  const Estimate labelled = fit_by_labels(set);
  const FaceFit fit = fit_by_lengths(set);
  ASSERT_TRUE(fit.fitted);
  const Eigen::Vector3d s = Eigen::Matrix3d(fit.estimate.response.sensitivity).diagonal();
  const double sd = std::sqrt(labelled.statistics.residual_sd.cwiseQuotient(s).cwiseAbs2().mean());
  EXPECT_MATRIX_NEAR(fit.estimate.statistics.residual_sd, sd * s, 1e-12);
  EXPECT_EQ(fit.estimate.statistics.degrees_of_freedom(0),
            labelled.statistics.degrees_of_freedom.sum());
}

TEST(FaceLengths, ForgetWhatTheLabelledFitSaid) {
  const FaceFit fit = fit_by_lengths(leaning_set(4, 0.01, 1e-3, 10));
  ASSERT_TRUE(fit.fitted);
  const FitStatistics& statistics = fit.estimate.statistics;
  EXPECT_TRUE(statistics.lack_of_fit.empty());
  EXPECT_TRUE(statistics.components.empty());
  EXPECT_EQ(statistics.interval_95.size(), 0);
  EXPECT_TRUE(statistics.studentized.array().isNaN().all());
  EXPECT_FALSE(fit.estimate.levelness.has_value());
}

// If the fit by lengths is not possible, the estimate by labels does not change.
void expect_refused(const ReadingSet& set, const Estimate& labelled) {
  Estimate estimate = labelled;
  EXPECT_FALSE(fit_face_lengths(set, length_of_field, estimate));
  EXPECT_MATRIX_NEAR(estimate.response.bias, labelled.response.bias, 0.0);
  EXPECT_MATRIX_NEAR(estimate.response.sensitivity, labelled.response.sensitivity, 0.0);
  EXPECT_MATRIX_NEAR(estimate.statistics.covariance, labelled.statistics.covariance, 0.0);
  EXPECT_EQ(estimate.notes.size(), labelled.notes.size());
}

TEST(FaceLengths, NeedAllSixFaces) {
  std::vector<DesignEntry> design = standard_design(24);
  std::erase_if(design,
                [](const DesignEntry& entry) { return entry.point.rest() == Face::plus_y; });
  const ReadingSet set = test::labelled_set(
      diagonal_response(), test::gravity_in_table(Eigen::Vector3d(0.0, 0.0, length_of_field)),
      design, 1e-3, 11);
  expect_refused(set, fit_by_labels(set));
}

TEST(FaceLengths, NeedAFieldAcrossTheFaces) {
  const ReadingSet set = test::labelled_set(
      diagonal_response(), test::gravity_in_table(length_of_field * Eigen::Vector3d(0.0, 0.6, 0.8)),
      standard_design(24), 1e-3, 12);
  expect_refused(set, fit_by_labels(set));
}

TEST(FaceLengths, NeedAxesAlongDifferentEdges) {
  LinearResponse truth = diagonal_response();
  truth.sensitivity.row(1) = Eigen::RowVector3d(1.5, 1.2, 0.0);
  const ReadingSet set = leaning_set(2, 0.0, 1e-3, 13, truth);
  expect_refused(set, fit_by_labels(set));
}

TEST(FaceLengths, NeedAnEstimateWithoutFurtherTerms) {
  const ReadingSet set = leaning_set(2, 0.0, 1e-3, 14);
  Estimate labelled = fit_by_labels(set);
  labelled.statistics.covariance = Eigen::MatrixXd::Identity(18, 18);
  expect_refused(set, labelled);
}

}  // namespace
}  // namespace axiscal
