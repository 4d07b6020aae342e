// SPDX-License-Identifier: Apache-2.0
#include "culprit_fit.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include <Eigen/QR>

#include "axiscal/calib/response_system.hpp"
#include "axiscal/calib/scaled_cholesky.hpp"
#include "axiscal/calib/scaled_qr.hpp"

namespace axiscal {
namespace {

// Rounds until the fields stay; a mistake of one radian takes some more.
constexpr int most_rounds = 30;
constexpr double open_below = 1e-7;

// The main axis alone, and no scale: [P]'s linear form.
void start_temperature(ReadingSet& set) {
  set.temperature.scale.setZero(set.axis_count(), set.temperature.order);
  set.temperature.along = SensitivityMatrix::Zero(set.axis_count(), 3);
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const std::optional<int>& nominal = set.nominal[static_cast<std::size_t>(k)];
    set.temperature.along(k, nominal.value_or(static_cast<int>(k % 3))) = 1.0;
  }
}

// Takes what the columns d^j (S f) found into the scales.
// @return the change of the scale over the run's temperatures.
double fold_scales(Eigen::MatrixXd& coefficients, ReadingSet& set) {
  const int order = set.temperature.order;
  const double span = set.temperature.d.cwiseAbs().maxCoeff();
  double change = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const Eigen::RowVector3d S = coefficients.col(k).segment<3>(1).transpose();
    const auto along = set.temperature.along.row(k);
    const double unit = along.dot(S) / along.squaredNorm();
    if (unit == 0.0) {
      continue;
    }
    const Eigen::RowVectorXd found = coefficients.col(k).tail(order).transpose() / unit;
    for (int j = 0; j < order; ++j) {
      change = std::max(change, std::abs(found(j)) * std::pow(span, j + 1));
    }
    set.temperature.scale.row(k) += found;
    set.temperature.along.row(k) = S;
    coefficients.col(k).tail(order).setZero();
  }
  return change;
}

// Moves the fields by a step of their directions, cut to what a linear step is good for.
// @return the largest turn [rad].
double turn_fields(const std::vector<TableField::Tangents>& tangents,
                   Eigen::VectorXd turn,
                   TableField& field) {
  double turned = 0.0;
  Eigen::Index first = 0;
  for (const TableField::Tangents& of_field : tangents) {
    constexpr double longest_step_rad = 0.5;
    auto part = turn.segment(first, of_field.cols());
    part *= std::min(1.0, longest_step_rad / std::max(part.norm(), 1e-300));
    turned = std::max(turned, part.norm());
    first += of_field.cols();
  }
  field = field.moved(tangents, turn);
  return turned;
}

// The own columns of each axis, which those of like weights factor once.
class OwnColumns {
 public:
  // @param root  n x m: what each reading of an axis is multiplied by.
  OwnColumns(const ReadingSet& set,
             const TableField& field,
             const Eigen::MatrixXd& root,
             double open_below) {
    const Eigen::MatrixXd base = field_design(set, field);
    scale_ = root.colwise().maxCoeff().transpose();
    for (Eigen::Index first = 0; first < set.axis_count();) {
      const Eigen::Index end = set.end_of_alike(first, set.weights);
      Factored one{.X = set.all_columns(base, first), .first = first, .count = end - first};
      const Eigen::MatrixXd weighted = (root.col(first) / scale_(first)).asDiagonal() * one.X;
      const ScaledQr qr(weighted, open_below);
      if (!qr.has_full_rank()) {
        determined_ = false;
        return;
      }
      one.T = qr.root_of_covariance();
      one.Q = std::make_shared<const Eigen::MatrixXd>(weighted * one.T);
      factored_.push_back(std::move(one));
      first = end;
    }
  }

  [[nodiscard]] bool determined() const { return determined_; }

  // The columns of an axis, not weighted.
  [[nodiscard]] const Eigen::MatrixXd& columns(Eigen::Index k) const {
    return std::find_if(factored_.begin(), factored_.end(),
                        [k](const Factored& one) { return k < one.first + one.count; })
        ->X;
  }

  // What weighted readings of the axes, n x m, make of their coefficients; p x m.
  [[nodiscard]] Eigen::MatrixXd coefficients(const Eigen::MatrixXd& Y) const {
    Eigen::MatrixXd all(factored_.front().T.rows(), Y.cols());
    for (const Factored& one : factored_) {
      all.middleCols(one.first, one.count) =
          one.T * (one.Q->transpose() * Y.middleCols(one.first, one.count)) *
          scale_.segment(one.first, one.count).cwiseInverse().asDiagonal();
    }
    return all;
  }

  // What the axes' own columns leave of others, axis below axis: (n m) x c.
  [[nodiscard]] Eigen::MatrixXd left_of(const Eigen::MatrixXd& Z) const {
    Eigen::MatrixXd left(Z.rows(), Z.cols());
    const Eigen::Index n = Z.rows() / scale_.size();
    for (const Factored& one : factored_) {
      for (Eigen::Index j = 0; j < Z.cols(); ++j) {
        const auto of_axes = Z.col(j).segment(n * one.first, n * one.count).reshaped(n, one.count);
        left.col(j).segment(n * one.first, n * one.count).reshaped(n, one.count) =
            of_axes - *one.Q * (one.Q->transpose() * of_axes);
      }
    }
    return left;
  }

  [[nodiscard]] std::vector<std::shared_ptr<const Eigen::MatrixXd>> bases() const {
    std::vector<std::shared_ptr<const Eigen::MatrixXd>> all;
    for (const Factored& one : factored_) {
      all.insert(all.end(), static_cast<std::size_t>(one.count), one.Q);
    }
    return all;
  }

 private:
  // Of axes alike.
  struct Factored {
    Eigen::MatrixXd X;  // n x p
    Eigen::Index first = 0;
    Eigen::Index count = 0;
    Eigen::MatrixXd T;                         // p x p
    std::shared_ptr<const Eigen::MatrixXd> Q;  // n x p
  };

  Eigen::VectorXd scale_;  // m: the largest weight's root
  std::vector<Factored> factored_;
  bool determined_ = true;
};

// What is shared, beside the axes' own columns: P z = b, P being less what the own take up.
struct SharedStep {
  bool determined = false;
  Eigen::VectorXd z;
  Eigen::MatrixXd root;   // T with T T^T the covariance of z and P T orthonormal
  Eigen::MatrixXd basis;  // P T, where the step needed it

  [[nodiscard]] Eigen::MatrixXd basis_of(const Eigen::MatrixXd& P) && {
    return basis.size() > 0 ? std::move(basis) : Eigen::MatrixXd(P * root);
  }

  // Whether all else takes up little of the first so many columns.
  // @param lengths  of the columns before it did.
  [[nodiscard]] bool is_well_determined(Eigen::Index count, const Eigen::VectorXd& lengths) const {
    return (root.topRows(count).rowwise().norm().array() * lengths.head(count).array() <
            widest_of_linear)
        .all();
  }
};

// Of many columns, as of a table that is levelled for each block, the normal equations take a
// twentieth of the time; nothing where these are few, or close to dependent.
std::optional<SharedStep> solve_many_shared(const Eigen::MatrixXd& P,
                                            const Eigen::VectorXd& lengths,
                                            const Eigen::VectorXd& b) {
  constexpr Eigen::Index few = 24;
  const Eigen::Index s = P.cols();
  if (s <= few) {
    return std::nullopt;
  }
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(s, s);
  normal.selfadjointView<Eigen::Lower>().rankUpdate(P.transpose());
  constexpr double clearly_open = 1e-6;  // of squares
  const ScaledCholesky cholesky(normal);
  if (!cholesky.is_determined(clearly_open) ||
      !(normal.diagonal().array() > clearly_open * lengths.array().square()).all()) {
    return std::nullopt;
  }
  SharedStep step{.determined = true, .root = cholesky.root_of_inverse()};
  step.z = step.root * (step.root.transpose() * (P.transpose() * b));
  return step;
}

// @param lengths  of the columns before the own took up their part: a column that is shorter than
//                 `open_below` of it is open.
SharedStep solve_shared(const Eigen::MatrixXd& P,
                        const Eigen::VectorXd& lengths,
                        const Eigen::VectorXd& b,
                        double open_below) {
  const Eigen::Index s = P.cols();
  if (s == 0) {
    return {.determined = true, .z = Eigen::VectorXd(0), .root = Eigen::MatrixXd(0, 0)};
  }
  if (P.rows() < s) {
    return {};
  }
  if (std::optional<SharedStep> quick = solve_many_shared(P, lengths, b)) {
    return *std::move(quick);
  }
  const Eigen::VectorXd per_length = lengths.cwiseMax(1e-300).cwiseInverse();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(P * per_length.asDiagonal());
  const auto R = qr.matrixQR().topRows(s).triangularView<Eigen::Upper>();
  if (!(qr.matrixQR().diagonal().array().abs() > open_below).all()) {
    return {};
  }
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(s, s);
  R.solveInPlace(inverse);
  SharedStep step{.determined = true,
                  .root = per_length.asDiagonal() * (qr.colsPermutation() * inverse)};
  step.basis = P * step.root;
  step.z = step.root * (step.basis.transpose() * b);
  return step;
}

}  // namespace

Eigen::Index HatBasis::cols() const {
  return width() * axes() + shared_.cols();
}

double HatBasis::hat(Eigen::Index axis,
                     Eigen::Index reading,
                     Eigen::Index other_axis,
                     Eigen::Index other_reading) const {
  const Eigen::Index n = readings();
  const double by_shared =
      shared_.row(n * axis + reading).dot(shared_.row(n * other_axis + other_reading));
  return axis != other_axis
             ? by_shared
             : by_shared + own_of(axis).row(reading).dot(own_of(axis).row(other_reading));
}

Eigen::MatrixXd HatBasis::leverage() const {
  Eigen::MatrixXd leverage = shared_.rowwise().squaredNorm().reshaped(readings(), axes());
  for (Eigen::Index k = 0; k < axes(); ++k) {
    leverage.col(k) += own_of(k).rowwise().squaredNorm();
  }
  return leverage;
}

Eigen::MatrixXd HatBasis::products_with(const Eigen::MatrixXd& Z) const {
  Eigen::MatrixXd products(cols(), Z.cols());
  for (Eigen::Index k = 0; k < axes(); ++k) {
    products.middleRows(width() * k, width()) =
        own_of(k).transpose() * Z.middleRows(readings() * k, readings());
  }
  products.bottomRows(shared_.cols()) = shared_.transpose() * Z;
  return products;
}

void HatBasis::add_product(Eigen::Index axis,
                           Eigen::Index reading,
                           const Eigen::Ref<const Eigen::RowVectorXd>& z,
                           Eigen::MatrixXd& products) const {
  const auto own = own_of(axis).row(reading).transpose();
  const auto shared = shared_.row(readings() * axis + reading).transpose();
  for (Eigen::Index j = 0; j < z.size(); ++j) {
    products.col(j).segment(width() * axis, width()) += z(j) * own;
    products.col(j).tail(shared.size()) += z(j) * shared;
  }
}

Eigen::MatrixXd HatBasis::shared_times(const Eigen::VectorXd& factors) const {
  Eigen::MatrixXd shared = shared_;
  for (Eigen::Index k = 0; k < axes(); ++k) {
    shared.middleRows(readings() * k, readings()) *= factors(k);
  }
  return shared;
}

// In the axes' scale; n x m.
Eigen::MatrixXd HypothesisFitter::roots_of_weights(const ReadingSet& set,
                                                   const std::vector<std::size_t>& without) const {
  Eigen::MatrixXd root = set.weights.cwiseSqrt();
  root.array().rowwise() /= scale_.transpose().array();
  for (const std::size_t i : without) {
    root.row(static_cast<Eigen::Index>(i)).setZero();
  }
  return root;
}

HypothesisFitter HypothesisFitter::by_scatter_of(const HypothesisFit& fit) const {
  const Eigen::VectorXd own =
      scale_.array() * (fit.rss.array() / fit.degrees_of_freedom.array().max(0.5)).sqrt();
  return {fit.field, known_field_, own};
}

HypothesisFit HypothesisFitter::again(const ReadingSet& set,
                                      const HypothesisFit& fit,
                                      const HypothesisFitter& whose) const {
  const Eigen::VectorXd factors = whose.scale_.cwiseQuotient(scale_);
  HypothesisFit scaled = fit;
  scaled.residuals *= factors.asDiagonal();
  if (known_field_) {  // axes that share no direction do not weigh on each other
    scaled.rss.array() *= factors.array().square();
    return scaled;
  }
  const Eigen::MatrixXd shared = fit.basis.shared_times(factors);
  SharedStep step =
      solve_shared(shared, shared.colwise().norm(), scaled.residuals.reshaped(), open_below);
  if (!step.determined) {
    return this->fit(set);
  }
  const Eigen::VectorXd change = shared * step.z;
  scaled.residuals.reshaped() -= change;
  scaled.turns = fit.turns * step.root;
  const double turned = (fit.turns * step.z).norm();
  const double left = scaled.residuals.norm();
  if (!(turned < small_turn_rad && left * scaled.turns.norm() < small_residuals &&
        turned * change.norm() < nothing * left)) {
    return this->fit(set);
  }
  scaled.basis = fit.basis.with(std::move(step).basis_of(shared));
  describe(set, roots_of_weights(set, {}), scaled);
  return scaled;
}

// What is said of a fit that has settled.
void HypothesisFitter::describe(const ReadingSet& set,
                                const Eigen::MatrixXd& root,
                                HypothesisFit& result) const {
  const Eigen::Index m = set.axis_count();
  result.fitted = true;
  result.rss.resize(m);
  result.degrees_of_freedom.resize(m);
  const Eigen::MatrixXd leverage = result.basis.leverage();
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto used = static_cast<double>((root.col(k).array() > 0.0).count());
    const double least = std::pow(set.rounding(k) / scale_(k), 2);
    result.degrees_of_freedom(k) = used - leverage.col(k).sum();
    result.rss(k) = std::max(result.residuals.col(k).squaredNorm(),
                             least * std::max(result.degrees_of_freedom(k), 0.0));
  }
}

HypothesisFit HypothesisFitter::fit(const ReadingSet& given,
                                    const std::vector<std::size_t>& without,
                                    const AddedColumns& added) const {
  // What a mistake made of the temperature terms must not stay in them.
  std::optional<ReadingSet> over_temperature;
  if (given.temperature.order > 0) {
    over_temperature = given;
    start_temperature(*over_temperature);
  }
  const ReadingSet& set = over_temperature ? *over_temperature : given;
  const Eigen::Index n = set.size();
  const Eigen::Index m = set.axis_count();
  const Eigen::Index p = set.column_count();
  const Eigen::MatrixXd root = roots_of_weights(set, without);
  HypothesisFit result;
  result.field = field_;
  result.coefficients = Eigen::MatrixXd::Zero(p, m);
  const bool free_field = !known_field_;
  double previous = -1.0;
  double turned_before = 0.0;
  bool has_coefficients = false;
  for (int round = 0; round < most_rounds; ++round) {
    const OwnColumns own(set, result.field, root, open_below);
    if (!own.determined()) {
      return result;
    }
    if (!has_coefficients) {
      result.coefficients = own.coefficients(root.cwiseProduct(set.response));
    }
    const Eigen::MatrixXd Z =
        added ? added(result.field, result.coefficients) : Eigen::MatrixXd(n * m, 0);
    const Eigen::Index q = Z.cols();
    const std::vector<TableField::Tangents> tangents =
        free_field ? result.field.tangents() : std::vector<TableField::Tangents>();
    const FieldChanges changes =
        free_field ? changes_with_directions(set, result.field, tangents) : FieldChanges(3 * n, 0);
    const Eigen::Index D = changes.cols();
    Eigen::MatrixXd shared(n * m, D + q);
    Eigen::MatrixXd b(n, m);
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto w = root.col(k);
      const Eigen::VectorXd of_axis = result.coefficients.col(k);
      auto columns = shared.middleRows(n * k, n);
      columns << response_changes(set, k, of_axis.segment<3>(1).transpose(), changes),
          Z.middleRows(n * k, n);
      columns = w.asDiagonal() * columns;
      b.col(k) = w.cwiseProduct(set.response.col(k) - own.columns(k) * of_axis);
    }
    const Eigen::MatrixXd P = own.left_of(shared);
    Eigen::VectorXd left = own.left_of(b.reshaped());
    const Eigen::VectorXd lengths = shared.colwise().norm().transpose();
    SharedStep step = solve_shared(P, lengths, left, open_below);
    if (!step.determined) {
      return result;
    }
    b.reshaped() -= shared * step.z;
    const Eigen::MatrixXd change = own.coefficients(b);
    // The largest change of a sensitivity, in parts of it.
    const double scaled = (change.middleRows<3>(1).colwise().norm().array() /
                           result.coefficients.middleRows<3>(1).colwise().norm().array())
                              .maxCoeff();
    result.coefficients += change;
    left -= P * step.z;
    double turned = 0.0;
    bool is_linear = false;  // what the next step would change is nothing beside the residuals
    if (free_field) {
      turned = turn_fields(tangents, step.z.head(D), result.field);
      // The next step takes up what this one left out: the turn's own square and its product with
      // the change of the sensitivities. That holds where residuals are small beside the readings,
      // so that a turn changes what they are along by little, and where the other columns leave the
      // directions their own; else how fast the steps shrink must tell.
      constexpr double quickly = 0.01;
      const bool is_near = turned < small_turn_rad &&
                           left.norm() < small_residuals * lengths.head(D).minCoeff() &&
                           step.is_well_determined(D, lengths);
      const bool ends = is_near || turned < quickly * turned_before;
      is_linear =
          q == 0 && !over_temperature && ends &&
          (turned + scaled) * (shared.leftCols(D) * step.z.head(D)).norm() < nothing * left.norm();
      turned_before = turned;
    }
    // Coefficients follow the fields exactly; a linear step for both would go astray far from them.
    has_coefficients = turned < 0.02;
    if (over_temperature) {
      turned = std::max(turned, fold_scales(result.coefficients, *over_temperature));
    }
    result.residuals = left.reshaped(n, m);
    const double now = left.squaredNorm();
    const bool still =
        turned < 1e-9 || is_linear || (round > 2 && std::abs(now - previous) <= 1e-10 * now);
    previous = now;
    if (still) {
      result.added = step.z.tail(q);
      result.information = step.root.bottomRows(q).rowwise().squaredNorm().cwiseInverse();
      result.turns = step.root.topRows(D);
      result.basis = HatBasis(own.bases(), std::move(step).basis_of(P));
      describe(set, root, result);
      return result;
    }
  }
  return result;  // does not settle
}

}  // namespace axiscal
