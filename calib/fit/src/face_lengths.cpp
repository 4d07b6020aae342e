// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/face_lengths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "calib/regression/gauss_newton.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns a number for the face of each reading: 2 * (index of the field's main component), plus 1
// if this component is negative. Returns nullopt if a field is not along an axis of the sensor's
// frame, or if a face is missing.
std::optional<std::vector<int>> faces_met(const ReadingSet& set,
                                          const TableField& field,
                                          double F) {
  const Eigen::MatrixXd met = field_design(set, field).middleCols<3>(1) / F;
  std::vector<int> faces;
  std::array<bool, 6> seen{};
  for (Eigen::Index i = 0; i < met.rows(); ++i) {
    Eigen::Index component = 0;
    const double largest = met.row(i).cwiseAbs().maxCoeff(&component);
    constexpr double along = 1e-6;
    if (std::abs(met.row(i).norm() - 1.0) > along || std::abs(largest - 1.0) > along) {
      return std::nullopt;
    }
    faces.push_back(static_cast<int>(2 * component) + (met(i, component) < 0.0 ? 1 : 0));
    seen[static_cast<std::size_t>(faces.back())] = true;
  }
  const bool all = std::all_of(seen.begin(), seen.end(), [](bool one) { return one; });
  return all ? std::optional(faces) : std::nullopt;
}

// The bias b and the scale s of each axis. Axis k reads b_k + s_k f_c if c = main[k] is the
// component of the field along this axis.
struct Diagonal {
  std::vector<Eigen::Index> main;  // component of the field along each axis
  Eigen::VectorXd b, s;            // m

  // Returns the field along each of the m axes, computed from a reading [field unit].
  [[nodiscard]] Eigen::VectorXd field(const Eigen::MatrixXd& v, Eigen::Index i) const {
    return (v.row(i).transpose() - b).cwiseQuotient(s);
  }
};

// Returns the main component of each axis; nullopt if two axes have the same component.
std::optional<std::vector<Eigen::Index>> main_components(const SensitivityMatrix& S) {
  std::vector<Eigen::Index> main;
  for (Eigen::Index k = 0; k < S.rows(); ++k) {
    Eigen::Index component = 0;
    S.row(k).cwiseAbs().maxCoeff(&component);
    if (std::find(main.begin(), main.end(), component) != main.end()) {
      return std::nullopt;
    }
    main.push_back(component);
  }
  return main;
}

// Returns the mean weight of a reading over the axes.
double weight_of(const ReadingSet& set, Eigen::Index i) {
  return set.weights.row(i).mean();
}

// Computes the bias and scale of each axis from the two faces that put this axis along the field.
Diagonal six_point_formula(const ReadingSet& set,
                           const std::vector<int>& faces,
                           std::vector<Eigen::Index> main,
                           double F) {
  const Eigen::Index m = set.axis_count();
  Diagonal at{.main = std::move(main), .b = Eigen::VectorXd(m), .s = Eigen::VectorXd(m)};
  for (Eigen::Index k = 0; k < m; ++k) {
    std::array<double, 2> sum{};
    std::array<double, 2> weights{};
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const int face = faces[static_cast<std::size_t>(i)];
      if (face / 2 == at.main[static_cast<std::size_t>(k)]) {
        sum[static_cast<std::size_t>(face % 2)] += set.weights(i, k) * set.response(i, k);
        weights[static_cast<std::size_t>(face % 2)] += set.weights(i, k);
      }
    }
    const double plus = sum[0] / weights[0];
    const double minus = sum[1] / weights[1];
    at.b(k) = 0.5 * (plus + minus);
    at.s(k) = 0.5 * (plus - minus) / F;
  }
  return at;
}

// The fitted biases b and scales s, with their 2m x 2m covariance. The covariance is that for
// readings whose noise has a standard deviation of 1 field unit.
struct LengthSolution {
  Diagonal at;
  Eigen::MatrixXd unscaled_covariance;
  double squares = 0.0;  // weighted sum of the squared deviations |f| - F [field unit^2]
};

// The problem for gauss_newton(): fits the bias and scale of three axes so that the field f_i of
// each reading has the magnitude F.
class LengthProblem {
 public:
  using State = Diagonal;
  using Linear = Linearised;

  LengthProblem(const ReadingSet& set, double F) : set_(set), F_(F) {}

  void linearise(const Diagonal& at, Linearised& linear) const {
    const Eigen::Index n = set_.size();
    linear.residuals.resize(n);
    linear.jacobian.resize(n, 6);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector3d f = at.field(set_.response, i);
      const Eigen::Vector3d u = f.normalized();
      const double root = std::sqrt(weight_of(set_, i));
      linear.residuals(i) = root * (f.norm() - F_);
      linear.jacobian.block<1, 3>(i, 0) = -root * u.cwiseQuotient(at.s.head<3>()).transpose();
      linear.jacobian.block<1, 3>(i, 3) =
          -root * u.cwiseProduct(f).cwiseQuotient(at.s.head<3>()).transpose();
    }
  }

  [[nodiscard]] Diagonal moved(Diagonal at, const Eigen::VectorXd& step) const {
    at.b += step.head<3>();
    at.s += step.tail<3>();
    return at;
  }

  [[nodiscard]] double cost(const Diagonal& at, const Linearised& /*linear*/) const {
    double squares = 0.0;
    for (Eigen::Index i = 0; i < set_.size(); ++i) {
      squares += weight_of(set_, i) * std::pow(at.field(set_.response, i).norm() - F_, 2);
    }
    return squares;
  }

  // The length of a step, relative to the response to the full field.
  [[nodiscard]] double length(const Diagonal& at,
                              const Eigen::VectorXd& step,
                              const Linearised& /*linear*/) const {
    return std::hypot(step.head<3>().norm() / F_, step.tail<3>().norm()) / at.s.norm();
  }

 private:
  const ReadingSet& set_;
  double F_;
};

LengthSolution solved_by_length(const ReadingSet& set, Diagonal start, double F) {
  const LengthProblem problem(set, F);
  Diagonal at = gauss_newton(problem, std::move(start)).state;
  Linearised linear;
  problem.linearise(at, linear);
  return {.at = std::move(at),
          .unscaled_covariance = LeastSquaresDesign(linear.jacobian).unscaled_covariance(),
          .squares = linear.residuals.squaredNorm()};
}

LengthSolution solved_by_faces(const ReadingSet& set,
                               const std::vector<int>& faces,
                               Diagonal at,
                               double F) {
  const Eigen::Index m = set.axis_count();
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(2 * m, 2 * m);
  for (Eigen::Index k = 0; k < m; ++k) {
    std::array<double, 2> weights{};
    for (Eigen::Index i = 0; i < set.size(); ++i) {
      const int face = faces[static_cast<std::size_t>(i)];
      if (face / 2 == at.main[static_cast<std::size_t>(k)]) {
        weights[static_cast<std::size_t>(face % 2)] += set.weights(i, k);
      }
    }
    const double s2 = at.s(k) * at.s(k);
    C(k, k) = 0.25 * s2 * (1.0 / weights[0] + 1.0 / weights[1]);
    C(m + k, m + k) = C(k, k) / (F * F);
    C(k, m + k) = C(m + k, k) = 0.25 * s2 * (1.0 / weights[0] - 1.0 / weights[1]) / F;
  }
  return {.at = std::move(at), .unscaled_covariance = C};
}

// The standard deviation of a reading [field unit] and its degrees of freedom.
struct Scatter {
  double sd = 0.0;
  double degrees_of_freedom = 0.0;
};

Scatter scatter_of(const ReadingSet& set,
                   const LengthSolution& solution,
                   const Estimate& labelled) {
  constexpr double enough = 3.0;
  const double of_lengths = static_cast<double>(set.size()) - 6.0;
  if (set.axis_count() == 3 && of_lengths >= enough) {
    return {.sd = std::sqrt(solution.squares / of_lengths), .degrees_of_freedom = of_lengths};
  }
  const FitStatistics& statistics = labelled.statistics;
  const Eigen::VectorXd sd = statistics.residual_sd.cwiseQuotient(solution.at.s);
  return {.sd = std::sqrt(sd.cwiseAbs2().mean()),
          .degrees_of_freedom = statistics.degrees_of_freedom.sum()};
}

// Returns for each axis the mean square of the field that it reads on the faces of the other axes,
// relative to F^2. The tilt of the faces and the cross-axis terms contribute to it.
Eigen::VectorXd transverse_squares(const ReadingSet& set,
                                   const std::vector<int>& faces,
                                   const Diagonal& at,
                                   double F) {
  const Eigen::Index m = set.axis_count();
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(m);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(m);
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    const Eigen::VectorXd f = at.field(set.response, i) / F;
    for (Eigen::Index k = 0; k < m; ++k) {
      if (faces[static_cast<std::size_t>(i)] / 2 != at.main[static_cast<std::size_t>(k)]) {
        squares(k) += f(k) * f(k);
        count(k) += 1.0;
      }
    }
  }
  return squares.cwiseQuotient(count);
}

}  // namespace

bool fit_face_lengths(const ReadingSet& given, double F, Estimate& estimate) {
  const Eigen::Index m = given.axis_count();
  FitStatistics& statistics = estimate.statistics;
  if (statistics.covariance.rows() != 4 * m || m > 3 || given.seen.cols() > 0) {
    return false;
  }
  const ReadingSet set = at_reference(given, estimate);
  const std::optional<std::vector<int>> faces = faces_met(set, estimate.field, F);
  const auto main = main_components(estimate.response.sensitivity);
  if (!faces || !main) {
    return false;
  }
  Diagonal start = six_point_formula(set, *faces, *main, F);
  const LengthSolution solution = m == 3 ? solved_by_length(set, std::move(start), F)
                                         : solved_by_faces(set, *faces, std::move(start), F);
  const Diagonal& at = solution.at;
  if (!at.b.allFinite() || !at.s.allFinite() || at.s.cwiseAbs().minCoeff() == 0.0) {
    return false;
  }
  const Scatter scatter = scatter_of(set, solution, estimate);
  const Eigen::VectorXd transverse = transverse_squares(set, *faces, at, F);
  const Eigen::MatrixXd C = scatter.sd * scatter.sd * solution.unscaled_covariance;
  // The second-order effect of the tilt of the faces: the relative error of s, and the error of b
  // relative to s F.
  const double second = 0.5 * transverse.sum();
  statistics.covariance.setZero();
  estimate.response.bias = at.b;
  estimate.response.sensitivity.setZero(m, 3);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::Index bias = 4 * k;
    const Eigen::Index own = bias + 1 + at.main[static_cast<std::size_t>(k)];
    estimate.response.sensitivity(k, at.main[static_cast<std::size_t>(k)]) = at.s(k);
    const double s2 = at.s(k) * at.s(k);
    for (Eigen::Index j = 0; j < 3; ++j) {
      statistics.covariance(bias + 1 + j, bias + 1 + j) = s2 * transverse(k);
    }
    for (Eigen::Index l = 0; l < m; ++l) {
      const Eigen::Index other = 4 * l + 1 + at.main[static_cast<std::size_t>(l)];
      statistics.covariance(bias, 4 * l) = C(k, l);
      statistics.covariance(bias, other) = statistics.covariance(other, bias) = C(k, m + l);
      statistics.covariance(own, other) = C(m + k, m + l);
    }
    statistics.covariance(bias, bias) += s2 * F * F * second * second;
    statistics.covariance(own, own) += s2 * second * second;
    statistics.residual_sd(k) = scatter.sd * std::abs(at.s(k));
  }
  statistics.degrees_of_freedom.setConstant(scatter.degrees_of_freedom);
  statistics.interval_95.resize(0);
  statistics.interval_dof.resize(0);
  statistics.components.clear();
  statistics.lack_of_fit.clear();
  // These diagnostics belong to the fit that takes the stated faces as exact. The degrees of
  // freedom of that fit are different.
  statistics.studentized.setConstant(not_a_number);
  statistics.cooks_distance.setConstant(not_a_number);
  estimate.levelness.reset();
  estimate.curvature.reset();
  estimate.notes.push_back(
      {NoteCode::method,
       formatted("the readings lack fence faces, so bias and scale are fitted to the magnitude of "
                 "the field. A lean of the faces has almost no effect on bias and scale. The "
                 "readings do not determine the cross-axis terms, which are set to 0 (cross-axis "
                 "terms and lean together are about {} degrees). If the cube is square and the "
                 "table is level, the method 'known' can fit the cross-axis terms",
                 number_text(std::sqrt(transverse.mean()) * deg_per_rad, 2))});
  return true;
}

}  // namespace axiscal
