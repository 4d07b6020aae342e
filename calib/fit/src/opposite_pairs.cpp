// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/opposite_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <tuple>
#include <utility>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/not_a_number.hpp"

namespace axiscal {
namespace {

// Limit of the pivot in the fit of the slope to one face. If the pivot is smaller, a component of
// the slope affects the readings only through cross-axis terms, and the face gets no separate
// estimate.
constexpr double smallest_pivot_of_a_face = 0.2;

// The weighted mean of some readings of an axis. If the axis uses none of these readings, the
// weight is 0 and the value is meaningless.
struct WeightedMean {
  double value = 0.0;
  double weight = 0.0;  // sum of the weights
};

WeightedMean mean_of(const ReadingSet& set, std::span<const std::size_t> rows, Eigen::Index axis) {
  WeightedMean mean;
  for (const std::size_t i : rows) {
    const auto row = static_cast<Eigen::Index>(i);
    mean.value += set.weights(row, axis) * set.response(row, axis);
    mean.weight += set.weights(row, axis);
  }
  mean.value = mean.weight > 0.0 ? mean.value / mean.weight : 0.0;
  return mean;
}

// Returns the matrix that converts the field from the table's frame to the sensor's frame, averaged
// over the readings.
Eigen::Matrix3d mean_met(const ReadingSet& set, std::span<const std::size_t> rows) {
  if (set.field_then.empty()) {
    return set.met_of_field(rows.front());
  }
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  double weights = 0.0;
  for (const std::size_t i : rows) {
    const double weight = set.weights.row(static_cast<Eigen::Index>(i)).mean();
    sum += weight * set.met_of_field(i);
    weights += weight;
  }
  return weights > 0.0 ? Eigen::Matrix3d(sum / weights) : set.met_of_field(rows.front());
}

// The least-squares solution for the two components of the field in the table's plane, from the
// half differences of one or more faces.
struct PlaneFit {
  bool determined = false;
  Eigen::Vector2d f = Eigen::Vector2d::Zero();
  Eigen::Matrix2d unscaled_covariance = Eigen::Matrix2d::Zero();
  double rss = 0.0;
  Eigen::Index rows = 0;
};

// The half differences of all pairs of a block that have the same rest face. They are consecutive
// rows of `Differences`.
struct FaceDifferences {
  const OppositePair* pair = nullptr;  // the first pair of the face
  Eigen::Index first = 0;
  Eigen::Index rows = 0;
  PlaneFit alone;
};

using Faces = std::vector<const FaceDifferences*>;

// Weighted equations d = G f, ordered by faces. d contains the half differences of the readings,
// and f the two components of the field in the table's plane.
struct Differences {
  std::vector<FaceDifferences> faces;
  Eigen::MatrixX2d G;
  Eigen::VectorXd d;
};

Differences differences_by_face(const std::vector<OppositePair>& pairs,
                                const SensitivityMatrix& sensitivity,
                                const TableField& field) {
  const Groups by_face = pairs_by_face(pairs);
  const Eigen::Index axes = sensitivity.rows();
  Differences all;
  all.faces.reserve(by_face.size());
  const Eigen::Index most_rows = axes * static_cast<Eigen::Index>(pairs.size());
  all.G.resize(most_rows, 2);
  all.d.resize(most_rows);
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < by_face.size(); ++f) {
    FaceDifferences& face = all.faces.emplace_back();
    face.pair = &pairs[by_face[f].front()];
    face.first = at;
    for (const std::size_t q : by_face[f]) {
      const OppositePair& pair = pairs[q];
      const double normal = field.vector(pair.levelness).z();
      for (Eigen::Index k = 0; k < axes; ++k, ++at) {
        const double root = std::sqrt(pair.weights(k));
        const Eigen::RowVector3d seen =
            pair.level.of_all() * (sensitivity.row(k) * pair.half_rotation);
        all.G.row(at) = root * seen.head<2>();
        all.d(at) = root * (pair.half_difference(k) - normal * seen(2));
      }
    }
    face.rows = at - face.first;
  }
  if (at < most_rows) {
    all.G.conservativeResize(at, 2);
    all.d.conservativeResize(at);
  }
  return all;
}

// Solves d = G f by least squares.
// @param smallest_pivot  limit for the part of the shorter column that is orthogonal to the longer
//                        column, relative to the longer column. Below it, the two components are
//                        not determined.
PlaneFit fit_plane(const Eigen::Ref<const Eigen::MatrixX2d>& G,
                   const Eigen::Ref<const Eigen::VectorXd>& d,
                   double smallest_pivot = 1e-3) {
  PlaneFit fit;
  fit.rows = d.size();
  if (fit.rows < 2) {
    return fit;
  }
  // The decomposition G P = Q R of two columns; P puts the longer column first.
  const Eigen::Index first = G.col(1).squaredNorm() > G.col(0).squaredNorm() ? 1 : 0;
  const Eigen::Index second = 1 - first;
  const double length = G.col(first).norm();
  if (!(length > 0.0)) {
    return fit;
  }
  const auto along = G.col(first) / length;
  const double common = along.dot(G.col(second));
  const auto left = G.col(second) - common * along;
  const double height = left.norm();
  if (!(height > smallest_pivot * length)) {
    return fit;
  }
  fit.determined = true;
  fit.f(second) = left.dot(d) / (height * height);
  fit.f(first) = (along.dot(d) - common * fit.f(second)) / length;
  fit.rss = (d - G.lazyProduct(fit.f)).squaredNorm();
  Eigen::Matrix2d root;  // the product P R^-1
  root.row(first) << 1.0 / length, -common / (length * height);
  root.row(second) << 0.0, 1.0 / height;
  fit.unscaled_covariance = root * root.transpose();
  return fit;
}

PlaneFit fit_plane(const Differences& all, const Faces& faces) {
  if (faces.size() == all.faces.size()) {
    return fit_plane(all.G, all.d);
  }
  Eigen::Index rows = 0;
  for (const FaceDifferences* face : faces) {
    rows += face->rows;
  }
  Eigen::MatrixX2d G(rows, 2);
  Eigen::VectorXd d(rows);
  Eigen::Index at = 0;
  for (const FaceDifferences* face : faces) {
    G.middleRows(at, face->rows) = all.G.middleRows(face->first, face->rows);
    d.segment(at, face->rows) = all.d.segment(face->first, face->rows);
    at += face->rows;
  }
  return fit_plane(G, d);
}

double sample_sd(const std::vector<LevelnessEstimate>& estimates, double LevelnessEstimate::*part) {
  const auto n = static_cast<double>(estimates.size());
  double mean = 0.0;
  for (const LevelnessEstimate& estimate : estimates) {
    mean += estimate.*part / n;
  }
  double sum = 0.0;
  for (const LevelnessEstimate& estimate : estimates) {
    sum += std::pow(estimate.*part - mean, 2);
  }
  return n < 2.0 ? not_a_number : std::sqrt(sum / (n - 1.0));
}

// Groups of faces. The slope of the table is the same for all faces of a group.
using FacesByLevel = std::vector<Faces>;

// The fitted slopes, one for each group of faces.
struct PlaneFits {
  bool determined = true;
  std::vector<PlaneFit> fits;
  double rss = 0.0;
  double dof = 0.0;
};

PlaneFits fit_planes(const Differences& differences, const FacesByLevel& levels) {
  PlaneFits all;
  all.fits.reserve(levels.size());
  for (const Faces& faces : levels) {
    const PlaneFit& fit = all.fits.emplace_back(fit_plane(differences, faces));
    all.determined = all.determined && fit.determined;
    all.rss += fit.rss;
    all.dof += static_cast<double>(fit.rows) - 2.0;
  }
  return all;
}

// Returns the p-value of an F test of nested models: one slope for all blocks, or one slope for
// each block.
double block_p_value(const ReadingSet& set, const Differences& differences, const PlaneFit& all) {
  const Groups by_block(differences.faces.size(),
                        [&](std::size_t f) { return differences.faces[f].pair->block; });
  if (by_block.size() < 2) {
    return not_a_number;
  }
  FacesByLevel blocks(by_block.size());
  for (std::size_t g = 0; g < by_block.size(); ++g) {
    for (const std::size_t f : by_block[g]) {
      blocks[g].push_back(&differences.faces[f]);
    }
  }
  const PlaneFits own = fit_planes(differences, blocks);
  const double more = 2.0 * static_cast<double>(blocks.size() - 1);
  if (!own.determined || !(own.dof > 0.0)) {
    return not_a_number;
  }
  if (all.rss - own.rss <= more * set.rounding() * set.rounding()) {
    return 1.0;
  }
  return own.rss > 0.0
             ? f_upper_p(((all.rss - own.rss) / more) / (own.rss / own.dof), more, own.dof)
             : 0.0;
}

// The slope of the table from several faces. It is the mean of the faces' own estimates if each
// face has one. With fewer than three axes, a face shows the slope only through cross-axis terms,
// so all differences are fitted together.
struct MeanSlope {
  Eigen::Vector2d f = Eigen::Vector2d::Zero();
  Eigen::Matrix2d unscaled_covariance = Eigen::Matrix2d::Zero();
};

MeanSlope mean_slope(const Faces& faces, const PlaneFit& together, bool three_axes) {
  MeanSlope mean;
  const auto n = static_cast<double>(faces.size());
  for (const FaceDifferences* face : faces) {
    const PlaneFit& alone = face->alone;
    if (!alone.determined || !three_axes) {
      return {.f = together.f, .unscaled_covariance = together.unscaled_covariance};
    }
    mean.f += alone.f / n;
    mean.unscaled_covariance += alone.unscaled_covariance / (n * n);
  }
  return mean;
}

}  // namespace

Groups pairs_by_face(const std::vector<OppositePair>& pairs) {
  return Groups(
      pairs.size(), [&](std::size_t q) { return std::pair(pairs[q].block, pairs[q].point.rest()); },
      // pairs at level 0 do not contain the slope
      [&](std::size_t q) { return pairs[q].level.of_all() != 0.0; });
}

OppositePairs opposite_positions(const ReadingSet& set) {
  // Both points of a pair have the same block, level, temperature, rest face and axis of the fence
  // face; the level is last because it takes the longest to compare.
  const Groups candidates(set.readings.size(), [&](std::size_t i) {
    const Reading& reading = set.readings[i];
    return std::tuple(reading.block, set.soak_of(i), reading.point->rest(),
                      axis_of(reading.point->fence()), reading.level);
  });
  const auto is_at_point = [&](std::size_t i) {
    return is_positive(set.readings[i].point->fence());
  };
  OppositePairs result;
  result.pairs.reserve(candidates.size());
  result.readings.resize(set.readings.size());
  std::size_t at = 0;
  for (std::size_t g = 0; g < candidates.size(); ++g) {
    const std::span<const std::size_t> members = candidates[g];
    const std::span<std::size_t> own = std::span(result.readings).subspan(at, members.size());
    const auto middle = std::copy_if(members.begin(), members.end(), own.begin(), is_at_point);
    std::copy_if(members.begin(), members.end(), middle,
                 [&](std::size_t i) { return !is_at_point(i); });
    const auto at_point = static_cast<std::size_t>(middle - own.begin());
    if (at_point == 0 || at_point == own.size()) {
      result.unpaired.insert(result.unpaired.end(), own.begin(), own.end());
      continue;
    }
    const std::size_t front = members.front();
    const Reading& reading = set.readings[front];
    result.pairs.push_back(
        {.point = {reading.point->rest(), face_of(axis_of(reading.point->fence()), true)},
         .block = reading.block,
         .level = reading.level,
         .soak = set.soak_of(front),
         .levelness = set.tilt_of(front),
         .first = own.first(at_point),
         .second = own.subspan(at_point)});
    at += own.size();
  }
  std::sort(result.unpaired.begin(), result.unpaired.end());
  return result;
}

OppositePairs find_opposite_pairs(const ReadingSet& set) {
  OppositePairs result = opposite_positions(set);
  const Eigen::Index m = set.axis_count();
  result.averages.resize(m, 3 * static_cast<Eigen::Index>(result.pairs.size()));
  double* own = result.averages.data();
  for (OppositePair& pair : result.pairs) {
    for (Eigen::Index k = 0; k < m; ++k) {
      const WeightedMean a = mean_of(set, pair.first, k);
      const WeightedMean b = mean_of(set, pair.second, k);
      own[k] = 0.5 * (a.value + b.value);
      own[m + k] = 0.5 * (a.value - b.value);
      own[2 * m + k] = 4.0 / (1.0 / a.weight + 1.0 / b.weight);
    }
    // Placement new is Eigen's method to change the array of a Map.
    new (&pair.mean) Eigen::Map<const Eigen::VectorXd>(own, m);
    new (&pair.half_difference) Eigen::Map<const Eigen::VectorXd>(own + m, m);
    new (&pair.weights) Eigen::Map<const Eigen::VectorXd>(own + 2 * m, m);
    own += 3 * m;
    const Eigen::Matrix3d R_a = mean_met(set, pair.first);
    const Eigen::Matrix3d R_b = mean_met(set, pair.second);
    pair.mean_rotation = 0.5 * (R_a + R_b);
    pair.half_rotation = 0.5 * (R_a - R_b);
  }
  return result;
}

std::optional<Levelness> levelness_of(const ReadingSet& set,
                                      const std::vector<OppositePair>& pairs,
                                      const Estimate& estimate,
                                      double F) {
  const SensitivityMatrix& S = estimate.response.sensitivity;
  // Shifts of whole blocks cancel in the differences.
  if (set.temperature.order == 0 && set.effects.columns_within_blocks() == 0) {
    return estimate_levelness(set, pairs, S, estimate.field, F);
  }
  const ReadingSet still = at_reference(set, estimate);
  return estimate_levelness(still, find_opposite_pairs(still).pairs, S, estimate.field, F);
}

void put_levelness(const ReadingSet& set, double F, Estimate& estimate) {
  const Eigen::MatrixXd& robust = estimate.statistics.robust_weight;
  if (robust.rows() != set.size()) {
    estimate.levelness = levelness_of(set, find_opposite_pairs(set).pairs, estimate, F);
    return;
  }
  ReadingSet counted = set;  // becomes the set without the readings of robust weight 0
  counted.weights = (robust.array() == 0.0).select(0.0, counted.weights);
  estimate.levelness = levelness_of(counted, find_opposite_pairs(counted).pairs, estimate, F);
}

namespace {

// Increases the standard errors of the slope if the slopes of the faces scatter more than expected.
// They scatter if the cube is not seated the same way each time. The standard errors from the
// differences include only part of this error, so the larger standard error is used.
void count_scatter_of_faces(Levelness& levelness) {
  constexpr std::size_t fewest = 4;
  if (levelness.estimates.size() < fewest || !(levelness.degrees_of_freedom > 0.0)) {
    return;
  }
  constexpr double scatters = 0.25;  // limit of the p-value
  const auto n = static_cast<double>(levelness.estimates.size());
  const double square =
      0.5 * (levelness.sd_x * levelness.sd_x + levelness.sd_y * levelness.sd_y) / n;
  const double by_differences =
      0.5 * (std::pow(levelness.standard_error_x, 2) + std::pow(levelness.standard_error_y, 2));
  const double freedom = 2.0 * (n - 1.0);
  if (by_differences > 0.0 &&
      f_upper_p(square / by_differences, freedom, levelness.degrees_of_freedom) < scatters) {
    const double u = std::sqrt(square);
    levelness.standard_error_x = std::max(levelness.standard_error_x, u);
    levelness.standard_error_y = std::max(levelness.standard_error_y, u);
    levelness.degrees_of_freedom = freedom;
  }
}

}  // namespace

std::optional<Levelness> estimate_levelness(const ReadingSet& set,
                                            const std::vector<OppositePair>& pairs,
                                            const SensitivityMatrix& sensitivity,
                                            const TableField& field,
                                            double F) {
  Differences differences = differences_by_face(pairs, sensitivity, field);
  Faces faces;
  faces.reserve(differences.faces.size());
  FacesByLevel levels(set.field.blocks().size());
  if (levels.size() == 1) {
    levels.front().reserve(differences.faces.size());
  }
  for (FaceDifferences& face : differences.faces) {
    face.alone = fit_plane(differences.G.middleRows(face.first, face.rows),
                           differences.d.segment(face.first, face.rows), smallest_pivot_of_a_face);
    faces.push_back(&face);
    levels[face.pair->levelness].push_back(&face);
  }
  const PlaneFits planes = fit_planes(differences, levels);
  const PlaneFit all = levels.size() == 1 ? planes.fits.front() : fit_plane(differences, faces);
  if (!planes.determined) {
    return std::nullopt;
  }
  Levelness levelness;
  levelness.estimates.reserve(faces.size());
  for (const FaceDifferences* face : faces) {
    if (face->alone.determined) {
      levelness.estimates.push_back({.point = face->pair->point,
                                     .block = face->pair->block,
                                     .x = face->alone.f.x() / F,
                                     .y = face->alone.f.y() / F});
    }
  }
  const bool three_axes = sensitivity.rows() >= 3;
  const MeanSlope mean = mean_slope(faces, all, three_axes);
  levelness.mean_x = mean.f.x() / F;
  levelness.mean_y = mean.f.y() / F;
  levelness.sd_x = sample_sd(levelness.estimates, &LevelnessEstimate::x);
  levelness.sd_y = sample_sd(levelness.estimates, &LevelnessEstimate::y);
  levelness.degrees_of_freedom = planes.dof;
  const double s = planes.dof > 0.0 ? std::sqrt(planes.rss / planes.dof) : not_a_number;
  const auto standard_errors = [&](const MeanSlope& slope) -> Eigen::Vector2d {
    return s * slope.unscaled_covariance.diagonal().cwiseSqrt() / F;
  };
  levelness.standard_error_x = standard_errors(mean).x();
  levelness.standard_error_y = standard_errors(mean).y();
  if (three_axes) {  // each face determines both components of the slope equally well
    count_scatter_of_faces(levelness);
  }
  levelness.p_value = not_a_number;  // set by test_levelness()
  for (std::size_t i = 0; i < levels.size() && levels.size() > 1; ++i) {
    const MeanSlope own = mean_slope(levels[i], planes.fits[i], three_axes);
    levelness.blocks.push_back({.block = set.field.blocks()[i],
                                .x = own.f.x() / F,
                                .y = own.f.y() / F,
                                .standard_error_x = standard_errors(own).x(),
                                .standard_error_y = standard_errors(own).y()});
  }
  levelness.block_p_value =
      levelness.blocks.empty() ? block_p_value(set, differences, all) : not_a_number;
  return levelness;
}

}  // namespace axiscal
