// SPDX-License-Identifier: Apache-2.0
#include "calib/cube/src/solid_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "axiscal/calib/least_squares.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "calib/regression/factor.hpp"
#include "calib/regression/gauss_newton.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Rotates the frame of the cube so that the normals agree best with those of the nominal cube.
void fix_gauge(SolidState& state) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Face face : all_faces) {
    sum += nominal_normal(face) * state.normals[static_cast<std::size_t>(face)].transpose();
  }
  const Eigen::Matrix3d G = nearest_rotation(sum);
  for (Eigen::Vector3d& normal : state.normals) {
    normal = (G * normal).normalized();
  }
  for (Eigen::Matrix3d& mount : state.mounts) {
    mount = mount * G.transpose();
  }
}

// Returns a matrix (18 x 12) whose columns are two tangents of each face normal.
Eigen::Matrix<double, 18, 12> tangents_of_normals(const FaceNormals& normals) {
  Eigen::Matrix<double, 18, 12> T = Eigen::Matrix<double, 18, 12>::Zero();
  for (Eigen::Index r = 0; r < 6; ++r) {
    T.block<3, 2>(3 * r, 2 * r) = tangents_of(normals[static_cast<std::size_t>(r)]);
  }
  return T;
}

// Returns the combinations of the 12 tangents (12 x 9) that do not rotate the cube as a whole. They
// keep the sum of e_r cross n_r over the faces r at 0, where e_r is the nominal and n_r the actual
// normal.
Eigen::Matrix<double, 12, 9> gauge_basis(const Eigen::Matrix<double, 18, 12>& T) {
  Eigen::Matrix<double, 3, 12> constraint = Eigen::Matrix<double, 3, 12>::Zero();
  for (const Face face : all_faces) {
    constraint +=
        cross_matrix(nominal_normal(face)) * T.middleRows<3>(3 * static_cast<Eigen::Index>(face));
  }
  return orthogonal_complement(constraint.transpose());
}

Factor factored(const Eigen::MatrixXd& J, const std::vector<std::string>& names) {
  Factor factors(J);
  if (!factors.has_full_rank()) {
    std::vector<std::string> open = undetermined_column_names(undetermined_columns(J), names);
    const std::string list = joined(open);
    throw RankDeficientError(
        formatted("the readings do not determine {}; take all 12 points with each instrument",
                  list),
        std::move(open));
  }
  return factors;
}

}  // namespace

// States which columns of the Jacobian belong to which parameters of the fit.
struct SolidFit::Layout {
  Eigen::Matrix<double, 12, 9> gauge;
  Eigen::Matrix<double, 18, 12> tangents;
  // First column of each reference. Its columns are 3 for the mount, 2 for each slope of the table,
  // and m each for bias and scale if these are fitted.
  std::vector<Eigen::Index> reference;
  std::vector<Eigen::Index> shift;  // first column for the error of each instrument's record
  std::vector<std::string> names;
  Eigen::Index columns = 0;
};

SolidFit::SolidFit(const std::vector<SolidReference>& references,
                   const Positioner& drawing,
                   bool free_bias_and_scale)
    : references_(references), drawing_(drawing), free_bias_and_scale_(free_bias_and_scale) {
  std::vector<RecordErrors> records;
  for (const SolidReference& reference : references) {
    records.resize(std::max(records.size(), reference.instrument + 1));
    records[reference.instrument] = {.covariance = reference.covariance,
                                     .degrees_of_freedom = reference.calibration_dof,
                                     .sensitivity = reference.calibrated.sensitivity,
                                     .F = reference.F};
  }
  priors_ = record_priors(records);
}

LinearResponse SolidFit::response_of(const SolidState& state, std::size_t reference) const {
  const SolidReference& own = references_[reference];
  const Eigen::VectorXd change =
      priors_[own.instrument].root * state.shift[own.instrument];  // changes of b and S, by axis
  LinearResponse response{.bias = state.bias[reference], .sensitivity = own.calibrated.sensitivity};
  for (Eigen::Index axis = 0; axis < response.bias.size(); ++axis) {
    response.bias(axis) += change(4 * axis);
    response.sensitivity.row(axis) =
        state.scale[reference](axis) *
        (response.sensitivity.row(axis) + change.segment<3>(4 * axis + 1).transpose());
  }
  return response;
}

Positioner SolidFit::positioner_of(const FaceNormals& normals) const {
  PositionerDescription description = drawing_.description();
  for (std::size_t face = 0; face < normals.size(); ++face) {
    description.faces[face].normal = normals[face].normalized();
  }
  description.normal_covariance.reset();
  return Positioner(std::move(description));
}

SolidState SolidFit::start() const {
  SolidState state{.normals = Positioner().normals(),
                   .mounts = {},
                   .fields = {},
                   .bias = {},
                   .scale = {},
                   .shift = {}};
  for (const RecordPrior& prior : priors_) {
    state.shift.emplace_back(Eigen::VectorXd::Zero(prior.root.cols()));
  }
  // For each reference, the outward face normals in the sensor's frame, computed from its readings.
  std::vector<std::map<Face, Eigen::Vector3d>> seen;
  for (const SolidReference& reference : references_) {
    const auto [inverse, rank] = pseudo_inverse_with_rank(reference.calibrated.sensitivity);
    if (rank < 3) {
      throw RefusedError(formatted(
          "slot {}: an instrument needs three axes in different directions to measure a cube",
          reference.slot));
    }
    std::map<Face, Eigen::Vector3d>& own = seen.emplace_back();
    for (std::size_t i = 0; i < reference.run.readings.size(); ++i) {
      const Eigen::VectorXd v = reference.run.response.row(static_cast<Eigen::Index>(i));
      const Eigen::Vector3d up = inverse * (v - reference.calibrated.bias);
      own.try_emplace(reference.run.readings[i].point->rest(), Eigen::Vector3d::Zero())
          .first->second -= reference.sign * reference.run.readings[i].level.of_all() * up;
    }
    for (auto& [face, normal] : own) {
      normal.normalize();
    }
    state.mounts.emplace_back(Eigen::Matrix3d::Identity());
    state.fields.emplace_back(reference.level_count,
                              Eigen::Vector3d(0.0, 0.0, reference.sign * reference.F));
    state.bias.push_back(reference.calibrated.bias);
    state.scale.emplace_back(Eigen::VectorXd::Ones(reference.calibrated.bias.size()));
  }
  // Generalised Procrustes fit: alternately fits the mounts with the normals held constant, and the
  // normals with the mounts held constant.
  for (int round = 0; round < 10; ++round) {
    FaceNormals sum;
    sum.fill(Eigen::Vector3d::Zero());
    for (std::size_t k = 0; k < references_.size(); ++k) {
      Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
      for (const auto& [face, normal] : seen[k]) {
        A += normal * state.normals[static_cast<std::size_t>(face)].transpose();
      }
      state.mounts[k] = nearest_rotation(A);
      for (const auto& [face, normal] : seen[k]) {
        sum[static_cast<std::size_t>(face)] += state.mounts[k].transpose() * normal;
      }
    }
    for (std::size_t face = 0; face < sum.size(); ++face) {
      state.normals[face] = sum[face].normalized();
    }
    fix_gauge(state);
  }
  for (const Face face : all_faces) {
    const Eigen::Vector3d& normal = state.normals[static_cast<std::size_t>(face)];
    if (const std::string defect = defect_of_normal(face, normal); !defect.empty()) {
      throw RefusedError(
          formatted("the normal of face {}, averaged over its readings, {} Check the labels and "
                    "the records.",
                    face_name(face), defect));
    }
  }
  return state;
}

SolidFit::Layout SolidFit::layout(const SolidState& state) const {
  Layout layout;
  layout.tangents = tangents_of_normals(state.normals);
  layout.gauge = gauge_basis(layout.tangents);
  const auto add = [&](const std::string& name, Eigen::Index count) {
    for (Eigen::Index i = 0; i < count; ++i) {
      layout.names.push_back(name);
    }
    layout.columns += count;
  };
  add("face normals", 9);
  for (const SolidReference& reference : references_) {
    layout.reference.push_back(layout.columns);
    add("mount of slot " + reference.slot, 3);
    add("slope of the table under slot " + reference.slot,
        2 * static_cast<Eigen::Index>(reference.level_count));
    if (free_bias_and_scale_) {
      add("bias of slot " + reference.slot, reference.run.response.cols());
      add("scale of slot " + reference.slot, reference.run.response.cols());
    }
  }
  for (const RecordPrior& prior : priors_) {
    layout.shift.push_back(layout.columns);
    add("record of an instrument", prior.root.cols());
  }
  return layout;
}

Eigen::VectorXd SolidFit::residuals(const SolidState& state,
                                    const std::vector<double>& sigma) const {
  const Positioner cube = positioner_of(state.normals);
  std::vector<double> all;
  for (std::size_t k = 0; k < references_.size(); ++k) {
    const SolidReference& reference = references_[k];
    const LinearResponse response = response_of(state, k);
    for (std::size_t i = 0; i < reference.run.readings.size(); ++i) {
      const Reading& reading = reference.run.readings[i];
      const Eigen::VectorXd fit = response.at(
          reading.level.of_all() *
          (state.mounts[k] * (cube.rotation_table_from_positioner(*reading.point).transpose() *
                              state.fields[k][reference.levels[i]])));
      for (Eigen::Index axis = 0; axis < fit.size(); ++axis) {
        const double unit = reference.calibrated.sensitivity.row(axis).norm() * sigma[k] /
                            reference.root_weights[i];
        all.push_back((reference.run.response(static_cast<Eigen::Index>(i), axis) - fit(axis)) /
                      unit);
      }
    }
  }
  for (const Eigen::VectorXd& shift : state.shift) {
    for (const double value : shift) {
      all.push_back(-value);
    }
  }
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

Eigen::MatrixXd SolidFit::jacobian(const SolidState& state,
                                   const Layout& layout,
                                   const std::vector<double>& sigma) const {
  // Computes the derivative of each seat's rotation with respect to each tangent by central
  // differences. If the cube has feet, its heading at the fence has no simple formula. The
  // differences are accurate, because the rotations are smooth functions of the normals.
  constexpr double step = 1e-5;
  const Positioner cube = positioner_of(state.normals);
  std::vector<Positioner> forward;
  std::vector<Positioner> backward;
  for (Eigen::Index j = 0; j < 12; ++j) {
    for (const double sign : {1.0, -1.0}) {
      FaceNormals normals = state.normals;
      const Eigen::Index face = j / 2;
      normals[static_cast<std::size_t>(face)] +=
          sign * step * layout.tangents.block<3, 1>(3 * face, j);
      (sign > 0.0 ? forward : backward).push_back(positioner_of(normals));
    }
  }
  Eigen::Index rows = layout.columns - layout.shift.front();
  for (const SolidReference& reference : references_) {
    rows += reference.run.response.size();
  }
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, layout.columns);
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < references_.size(); ++k) {
    const SolidReference& reference = references_[k];
    const Eigen::Index m = reference.run.response.cols();
    const Eigen::Index first = layout.reference[k];
    const Eigen::Index fields = first + 3;
    const Eigen::Index bias = fields + 2 * static_cast<Eigen::Index>(reference.level_count);
    const LinearResponse response = response_of(state, k);
    const Eigen::MatrixXd& prior = priors_[reference.instrument].root;
    for (std::size_t i = 0; i < reference.run.readings.size(); ++i, row += m) {
      const Reading& reading = reference.run.readings[i];
      const std::size_t level = reference.levels[i];
      const Eigen::Vector3d& field = state.fields[k][level];
      const Eigen::Matrix3d to_sensor =
          reading.level.of_all() * state.mounts[k] *
          cube.rotation_table_from_positioner(*reading.point).transpose();
      const Eigen::Vector3d f = to_sensor * field;
      Eigen::Matrix<double, 3, 12> by_normals;
      for (Eigen::Index j = 0; j < 12; ++j) {
        const auto at = static_cast<std::size_t>(j);
        const Eigen::Matrix3d change =
            (forward[at].rotation_table_from_positioner(*reading.point) -
             backward[at].rotation_table_from_positioner(*reading.point)) /
            (2.0 * step);
        by_normals.col(j) =
            reading.level.of_all() * (state.mounts[k] * (change.transpose() * field));
      }
      const Eigen::Matrix<double, 3, 9> by_gauge = by_normals * layout.gauge;
      const Eigen::Matrix3d by_mount = -cross_matrix(f);
      const Eigen::Matrix<double, 3, 2> by_field = to_sensor * (reference.F * tangents_of(field));
      for (Eigen::Index axis = 0; axis < m; ++axis) {
        const double length = reference.calibrated.sensitivity.row(axis).norm() * sigma[k] /
                              reference.root_weights[i];
        const Eigen::RowVector3d s = response.sensitivity.row(axis) / length;
        const Eigen::Index at = row + axis;
        J.row(at).head<9>() = s * by_gauge;
        J.row(at).segment<3>(first) = s * by_mount;
        J.row(at).segment<2>(fields + 2 * static_cast<Eigen::Index>(level)) = s * by_field;
        if (free_bias_and_scale_) {
          J(at, bias + axis) = 1.0 / length;
          J(at, bias + m + axis) = s.dot(f) / state.scale[k](axis);
        }
        J.row(at).segment(layout.shift[reference.instrument], prior.cols()) =
            (prior.row(4 * axis) +
             state.scale[k](axis) * (f.transpose() * prior.middleRows<3>(4 * axis + 1))) /
            length;
      }
    }
  }
  J.bottomRightCorner(rows - row, rows - row).setIdentity();
  return J;
}

void SolidFit::move(SolidState& state, const Layout& layout, const Eigen::VectorXd& step) const {
  const Eigen::Matrix<double, 18, 1> change = layout.tangents * (layout.gauge * step.head<9>());
  for (Eigen::Index face = 0; face < 6; ++face) {
    Eigen::Vector3d& normal = state.normals[static_cast<std::size_t>(face)];
    normal = (normal + change.segment<3>(3 * face)).normalized();
  }
  for (std::size_t k = 0; k < references_.size(); ++k) {
    const Eigen::Index m = references_[k].run.response.cols();
    Eigen::Index at = layout.reference[k];
    state.mounts[k] = rotation_by(step.segment<3>(at)) * state.mounts[k];
    at += 3;
    for (Eigen::Vector3d& field : state.fields[k]) {
      const double F = field.norm();
      field = F * (field / F + tangents_of(field) * step.segment<2>(at)).normalized();
      at += 2;
    }
    if (free_bias_and_scale_) {
      state.bias[k] += step.segment(at, m);
      state.scale[k] += step.segment(at + m, m);
    }
  }
  for (std::size_t instrument = 0; instrument < priors_.size(); ++instrument) {
    Eigen::VectorXd& shift = state.shift[instrument];
    shift += step.segment(layout.shift[instrument], shift.size());
  }
  fix_gauge(state);
}

// Computes the scatter of each reference from the residuals of the last fit. A reference with too
// few degrees of freedom gets the pooled scatter of all references.
std::vector<double> SolidFit::scatter(const std::vector<double>& sigma,
                                      const Eigen::VectorXd& residuals,
                                      const Eigen::VectorXd& leverage,
                                      double& degrees_of_freedom) const {
  constexpr double fewest_dof = 4.0;
  constexpr double rounding = 1e-15;
  std::vector<double> squares;
  std::vector<double> dof;
  Eigen::Index row = 0;
  for (const SolidReference& reference : references_) {
    const Eigen::Index rows = reference.run.response.size();
    squares.push_back(residuals.segment(row, rows).squaredNorm());
    dof.push_back(static_cast<double>(rows) - leverage.segment(row, rows).sum());
    row += rows;
  }
  degrees_of_freedom = std::accumulate(dof.begin(), dof.end(), 0.0);
  const double all = std::accumulate(squares.begin(), squares.end(), 0.0);
  const double pooled = degrees_of_freedom > 0.5 ? all / degrees_of_freedom : 1.0;
  std::vector<double> next;
  for (std::size_t k = 0; k < references_.size(); ++k) {
    const double own = dof[k] >= fewest_dof ? squares[k] / dof[k] : pooled;
    next.push_back(std::max(sigma[k] * std::sqrt(own), rounding * references_[k].F));
  }
  return next;
}

void SolidFit::describe(const Layout& layout,
                        const Eigen::MatrixXd& J,
                        const Eigen::MatrixXd& C,
                        SolidSolution& solution) const {
  solution.basis = layout.tangents * layout.gauge;
  const Eigen::Index readings = J.rows() - (layout.columns - layout.shift.front());
  const Eigen::MatrixXd by_noise = C * J.topRows(readings).transpose();
  solution.noise = by_noise.topRows<9>() * by_noise.topRows<9>().transpose();
  for (const Eigen::Index first : layout.reference) {
    const Eigen::MatrixXd own = by_noise.middleRows<3>(first);
    solution.mount_noise.emplace_back(own * own.transpose());
  }
  solution.handed_on.setZero();
  double over_dof = 0.0;
  for (std::size_t instrument = 0; instrument < priors_.size(); ++instrument) {
    const RecordPrior& prior = priors_[instrument];
    const Eigen::MatrixXd P = C.block(0, layout.shift[instrument], 9, prior.root.cols());
    const Eigen::Matrix<double, 9, 9> part = P * P.transpose();
    solution.handed_on += part;
    over_dof += prior.degrees_of_freedom > 0.0
                    ? part.trace() * part.trace() / prior.degrees_of_freedom
                    : 0.0;
  }
  const double trace = solution.handed_on.trace();
  solution.calibration_dof = over_dof > 0.0 ? trace * trace / over_dof : 0.0;
}

std::vector<int> SolidFit::worst_runs(const Eigen::VectorXd& residuals) const {
  std::vector<int> runs;
  Eigen::Index row = 0;
  for (const SolidReference& reference : references_) {
    const Eigen::Index m = reference.run.response.cols();
    double largest = -1.0;
    runs.push_back(0);
    for (const Reading& reading : reference.run.readings) {
      if (residuals.segment(row, m).norm() > largest) {
        largest = residuals.segment(row, m).norm();
        runs.back() = reading.run;
      }
      row += m;
    }
  }
  return runs;
}

// A state of the Gauss-Newton search, with the layout of its Jacobian's columns.
struct SolidFit::Place {
  SolidState state;
  Layout layout;
};

// The least-squares problem for gauss_newton(), with a given scatter of each reference.
struct SolidFit::Problem {
  using State = Place;
  using Linear = Linearised;

  void linearise(const Place& at, Linear& linear) const {
    linear.residuals = -fit.residuals(at.state, sigma);
    linear.jacobian = fit.jacobian(at.state, at.layout, sigma);
  }
  [[nodiscard]] Place moved(const Place& at, const Eigen::VectorXd& step) const {
    SolidState state = at.state;
    fit.move(state, at.layout, step);
    Layout layout = fit.layout(state);
    return {.state = std::move(state), .layout = std::move(layout)};
  }
  [[nodiscard]] double cost(const Place& at, const Linear& /*before*/) const {
    return fit.residuals(at.state, sigma).squaredNorm();
  }
  // Returns the length of a step in the normals and the first reference's mount [rad].
  [[nodiscard]] static double length(const Place& at,
                                     const Eigen::VectorXd& step,
                                     const Linear& /*there*/) {
    return step.head(at.layout.reference.front() + 3).norm();
  }

  const SolidFit& fit;
  const std::vector<double>& sigma;
};

SolidSolution SolidFit::solve() const {
  SolidSolution solution;
  Place place{.state = start(), .layout = {}};
  place.layout = layout(place.state);
  solution.sigma.assign(references_.size(), 1e-3 * references_.front().F);
  // The fit is repeated, because the scatter determines the weight of the records in the fit, and
  // the fit determines the scatter.
  constexpr int rounds_of_scatter = 4;
  for (int outer = 0; outer <= rounds_of_scatter; ++outer) {
    const Problem problem{.fit = *this, .sigma = solution.sigma};
    if (outer == 0) {  // throws if a parameter is undetermined, before the search
      static_cast<void>(
          factored(jacobian(place.state, place.layout, solution.sigma), place.layout.names));
    }
    constexpr double always = std::numeric_limits<double>::infinity();
    auto found =
        gauss_newton(problem, std::move(place),
                     {.most_rounds = 20, .settled = 1e-11 /* rad */, .qr_from_below = always});
    place = std::move(found.state);
    constexpr double good_enough_rad = 1e-8;  // rounding errors may prevent smaller steps
    if (!(found.left_to_go < good_enough_rad)) {
      throw RefusedError(
          "the fit of the cube's normals does not converge; check the labels of the readings, and "
          "check that each calibration record is that of the instrument which took the readings "
          "given with it");
    }
    const Eigen::MatrixXd J = jacobian(place.state, place.layout, solution.sigma);
    const Factor factors = factored(J, place.layout.names);
    const Eigen::VectorXd left = residuals(place.state, solution.sigma);
    if (outer < rounds_of_scatter) {
      solution.sigma =
          scatter(solution.sigma, left, factors.leverage(), solution.degrees_of_freedom);
    } else {
      describe(place.layout, J, factors.covariance(), solution);
      solution.worst_runs = worst_runs(left);
    }
  }
  solution.state = std::move(place.state);
  return solution;
}

}  // namespace axiscal
