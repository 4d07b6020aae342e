// SPDX-License-Identifier: Apache-2.0
#include "culprit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/design.hpp"
#include "culprit_fit.hpp"
#include "warnings.hpp"

namespace axiscal {
namespace {

// Nested F tests take the axes' noise as equal, or of a stated ratio, and are held against this
// level over all classes; as the tests of a class overlap, 0.6 % of good runs are called bad (MC).
constexpr double false_alarm = 0.016;
constexpr double classes = 6.0;
constexpr double worth_a_look = 0.04;  // of the quick tests, before any refit
// Below this probability of the axes' scatters their noise clearly differs.
constexpr double unequal_below = 0.01;
constexpr double false_alarm_by_axis = 0.001;

// Ranges of what a mistake adds (METHOD 5), in rad and parts of the full response.
constexpr double angle_range_rad = 0.08;
constexpr double value_range = 4.0;
constexpr double drift_range = 0.04;

// Explanations within this of the best are reported too.
constexpr double as_likely = 3.0;

// Up to so many readings each is left out by a fit of its own, and the table moved after each. Of
// more, those that count most to first order: the time stays linear in the readings.
constexpr std::size_t each_is_fitted = 200;
constexpr std::size_t fitted_of_many = 48;

std::vector<std::size_t> first_of(const std::vector<std::size_t>& order, std::size_t count) {
  return {order.begin(),
          order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()))};
}

// Equality of variances (Bartlett).
double equality_p_value(const HypothesisFit& fit) {
  const auto m = static_cast<double>(fit.rss.size());
  const double nu = fit.dof();
  if (m < 2.0 || !(fit.degrees_of_freedom.minCoeff() > 1.0)) {
    return 1.0;
  }
  double statistic = nu * std::log(fit.total() / nu);
  double inverse = 0.0;
  for (Eigen::Index k = 0; k < fit.rss.size(); ++k) {
    const double own = fit.degrees_of_freedom(k);
    statistic -= own * std::log(fit.rss(k) / own);
    inverse += 1.0 / own;
  }
  statistic /= 1.0 + (inverse - 1.0 / nu) / (3.0 * (m - 1.0));
  return chi_squared_upper_p(std::max(statistic, 1e-12), m - 1.0);
}

// One explanation of a bad fit.
struct Explanation {
  double likelihood = 0.0;  // ln
  HypothesisFit fit;
  Correction correction;
  std::string words;  // behind "run 7: ", without how much better
};

class Search {
 public:
  Search(const ReadingSet& set, const Estimate& estimate, bool known_field)
      : set_(set),
        fitter_(estimate.fields,
                known_field,
                set.noise_ratio.size() > 0
                    ? set.noise_ratio
                    : Eigen::VectorXd(Eigen::VectorXd::Ones(set.axis_count()))),
        stated_ratio_(set.noise_ratio.size() > 0) {
    order_.resize(static_cast<std::size_t>(set.size()));
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return set.readings[a].run < set.readings[b].run;
    });
  }

  std::optional<Culprit> run() {
    plain_ = fitter_.fit(set_);
    if (!plain_.fitted || plain_.dof() < 2.0 * static_cast<double>(set_.axis_count())) {
      return std::nullopt;
    }
    if (!looks_bad()) {
      return std::nullopt;
    }
    delete_each();
    if (!is_bad()) {
      return std::nullopt;
    }
    explain();
    return culprit();
  }

 private:
  [[nodiscard]] Eigen::Index n() const { return set_.size(); }
  [[nodiscard]] Eigen::Index m() const { return set_.axis_count(); }
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(set_.size()); }
  [[nodiscard]] int run_of(std::size_t i) const { return set_.readings[i].run; }

  [[nodiscard]] double full_response(Eigen::Index k) const {
    return plain_.coefficients.col(k).segment<3>(1).norm() * plain_.fields.front().norm();
  }

  // ---- detection ----

  // Rows of some readings among all rows, which are by axis.
  [[nodiscard]] std::vector<Eigen::Index> rows_of(const std::vector<std::size_t>& readings) const {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index k = 0; k < m(); ++k) {
      for (const std::size_t i : readings) {
        rows.push_back(n() * k + static_cast<Eigen::Index>(i));
      }
    }
    return rows;
  }

  // What leaving readings out takes from the sum of squares, to first order.
  [[nodiscard]] double drop_without(const HypothesisFit& fit,
                                    const std::vector<std::size_t>& readings) const {
    const std::vector<Eigen::Index> rows = rows_of(readings);
    const Eigen::MatrixXd Q = fit.basis(rows, Eigen::all);
    const Eigen::VectorXd e = fit.residuals.reshaped()(rows);
    const auto size = static_cast<Eigen::Index>(rows.size());
    const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(size, size) - Q * Q.transpose();
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(M);
    // A reading that alone determines something has no residual to tell by.
    return ldlt.vectorD().minCoeff() > 1e-9 ? e.dot(ldlt.solve(e)) : 0.0;
  }

  // What added columns take from it.
  [[nodiscard]] double drop_with(const HypothesisFit& fit, const Eigen::MatrixXd& columns) const {
    Eigen::MatrixXd Z = columns;
    for (Eigen::Index k = 0; k < m(); ++k) {
      Z.middleRows(n() * k, n()) =
          (set_.weights.col(k).cwiseSqrt() / fitter_.scale()(k)).asDiagonal() *
          Z.middleRows(n() * k, n());
    }
    const Eigen::MatrixXd P = Z - fit.basis * (fit.basis.transpose() * Z);
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(P.transpose() * P);
    const Eigen::VectorXd c = P.transpose() * fit.residuals.reshaped().matrix();
    const double size = Z.colwise().squaredNorm().maxCoeff();
    return ldlt.vectorD().minCoeff() > 1e-9 * size ? c.dot(ldlt.solve(c)) : 0.0;
  }

  [[nodiscard]] static double f_test(double all, double dof, double drop, double q) {
    const double left = all - drop;
    if (!(dof - q >= 1.0) || !(drop > 0.0)) {
      return 1.0;
    }
    return left > 0.0 ? f_upper_p((drop / q) / (left / (dof - q)), q, dof - q) : 0.0;
  }

  // The smallest probability of the quick tests: one reading deleted.
  [[nodiscard]] double single_p(const HypothesisFit& fit) const {
    double largest = 0.0;  // of one test, the largest drop has the smallest probability
    for (std::size_t i = 0; i < count(); ++i) {
      largest = std::max(largest, drop_without(fit, {i}));
    }
    return std::min(1.0, static_cast<double>(n()) *
                             f_test(fit.total(), fit.dof(), largest, static_cast<double>(m())));
  }

  [[nodiscard]] std::vector<std::size_t> largest_residuals(std::size_t most) const {
    std::vector<std::size_t> all(count());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const Eigen::VectorXd size = plain_.residuals.rowwise().squaredNorm();
    std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
      return size(static_cast<Eigen::Index>(a)) > size(static_cast<Eigen::Index>(b));
    });
    return first_of(all, most);
  }

  // What the table moved after each reading takes from the sum of squares, to first order; by cut.
  // The columns of one cut are those of the next and one reading more, so their products with the
  // basis and the residuals are running sums.
  [[nodiscard]] std::vector<double> drops_with_table_moved(const HypothesisFit& fit) const {
    std::vector<double> drops(count(), 0.0);
    const Eigen::VectorXd residuals = fit.residuals.reshaped();
    const Eigen::VectorXd along = fit.basis.transpose() * residuals;
    Eigen::MatrixXd in_basis = Eigen::MatrixXd::Zero(fit.basis.cols(), 2);
    Eigen::Matrix2d ZtZ = Eigen::Matrix2d::Zero();
    Eigen::Vector2d Zte = Eigen::Vector2d::Zero();
    for (std::size_t cut = count() - 1; cut > 0; --cut) {
      const std::size_t i = order_[cut];
      const auto row = static_cast<Eigen::Index>(i);
      const Eigen::MatrixXd Z = table_rows(i, fit.fields, fit.coefficients);
      for (Eigen::Index k = 0; k < m(); ++k) {
        const Eigen::RowVector2d z =
            std::sqrt(set_.weights(row, k)) / fitter_.scale()(k) * Z.row(k);
        in_basis += fit.basis.row(n() * k + row).transpose() * z;
        ZtZ += z.transpose() * z;
        Zte += z.transpose() * residuals(n() * k + row);
      }
      const Eigen::Matrix2d left = ZtZ - in_basis.transpose() * in_basis;
      const Eigen::LDLT<Eigen::Matrix2d> ldlt(left);
      const Eigen::Vector2d c = Zte - in_basis.transpose() * along;
      const double size = ZtZ.diagonal().maxCoeff();
      drops[cut] = ldlt.vectorD().minCoeff() > 1e-9 * size ? c.dot(ldlt.solve(c)) : 0.0;
    }
    return drops;
  }

  // The cuts that are fitted: all, or of many those that count most.
  [[nodiscard]] std::vector<std::size_t> cuts() const {
    std::vector<std::size_t> all;
    for (std::size_t cut = 1; cut < count() && !fitter_.known_field(); ++cut) {
      all.push_back(cut);
    }
    if (all.size() > each_is_fitted) {
      const std::vector<double> drops = drops_with_table_moved(plain_);
      std::stable_sort(all.begin(), all.end(),
                       [&](std::size_t a, std::size_t b) { return drops[a] > drops[b]; });
      all.resize(fitted_of_many);
      std::sort(all.begin(), all.end());
    }
    return all;
  }

  // Columns of the classes that add some: table moved, drift, extremes.
  [[nodiscard]] double added_p(const HypothesisFit& fit) const {
    double moved = 0.0;
    if (!fitter_.known_field()) {
      const std::vector<double> drops = drops_with_table_moved(fit);
      moved = *std::max_element(drops.begin(), drops.end());
    }
    double shifted = 0.0;
    for (Eigen::Index k = 0; k < m(); ++k) {
      for (const bool top : {true, false}) {
        shifted = std::max(shifted, drop_with(fit, extreme_columns(k, top, fit)));
      }
    }
    const auto axes = static_cast<double>(m());
    const auto p_of = [&](double drop, double q) {
      return f_test(fit.total(), fit.dof(), drop, q);
    };
    return std::min({1.0, static_cast<double>(n() - 1) * p_of(moved, 2.0),
                     p_of(drop_with(fit, drift_columns()), axes), 2.0 * axes * p_of(shifted, 1.0)});
  }

  // Whether a closer look is worth its time: by all axes alike, and by each in its own scatter.
  [[nodiscard]] bool looks_bad() {
    constexpr double large_share = 0.003;
    for (Eigen::Index k = 0; k < m(); ++k) {
      const double rms = std::sqrt(plain_.rss(k) / static_cast<double>(n()));
      if (rms <= 2.0 * set_.rounding(k)) {
        continue;
      }
      if (rms > large_share * full_response(k)) {
        return true;
      }
    }
    if (only_rounding()) {
      return false;
    }
    const auto suspicious = [&](const HypothesisFit& fit) {
      return classes * std::min(single_p(fit), added_p(fit)) < worth_a_look;
    };
    if (suspicious(plain_)) {
      return true;
    }
    const Eigen::VectorXd own =
        (plain_.rss.array() / plain_.degrees_of_freedom.array().max(0.5)).sqrt() *
        fitter_.scale().array();
    const HypothesisFitter scaled(plain_.fields, fitter_.known_field(), own);
    const HypothesisFit again = scaled.fit(set_);
    return again.fitted && equality_p_value(plain_) < 0.5 &&
           classes * single_p(again) < worth_a_look;
  }

  [[nodiscard]] bool only_rounding() const {
    for (Eigen::Index k = 0; k < m(); ++k) {
      if (plain_.rss(k) > 4.0 * std::pow(set_.rounding(k), 2) * static_cast<double>(n())) {
        return false;
      }
    }
    return true;
  }

  void delete_each() {
    deletions_.assign(count(), {});
    by_deletion_.resize(count());
    std::iota(by_deletion_.begin(), by_deletion_.end(), std::size_t{0});
    std::vector<double> left(count());  // without each
    std::vector<std::size_t> fitted = by_deletion_;
    const auto sort_by_left = [&](std::vector<std::size_t>& readings) {
      std::stable_sort(readings.begin(), readings.end(),
                       [&](std::size_t a, std::size_t b) { return left[a] < left[b]; });
    };
    if (count() > each_is_fitted) {
      for (std::size_t i = 0; i < count(); ++i) {
        left[i] = plain_.total() - drop_without(plain_, {i});
      }
      sort_by_left(fitted);
      fitted.resize(fitted_of_many);
    }
    for (const std::size_t i : fitted) {
      deletions_[i] = fitter_.fit(set_, {i});
      deletions_[i].forget_readings();
      left[i] =
          deletions_[i].fitted ? deletions_[i].total() : std::numeric_limits<double>::infinity();
    }
    // Behind those that were fitted: the others are judged to first order only.
    sort_by_left(fitted);
    std::vector<bool> is_fitted(count(), false);
    for (const std::size_t i : fitted) {
      is_fitted[i] = true;
    }
    std::erase_if(by_deletion_, [&](std::size_t i) { return is_fitted[i]; });
    by_deletion_.insert(by_deletion_.begin(), fitted.begin(), fitted.end());
  }

  // Two readings deleted: all pairs where they are few, else of those that count most.
  void delete_pairs() {
    constexpr std::size_t few = 14;
    std::vector<std::size_t> candidates = by_deletion_;
    if (candidates.size() > few) {
      const std::vector<std::size_t> large = largest_residuals(few / 2);
      candidates.resize(few / 2);
      for (const std::size_t i : large) {
        if (std::find(candidates.begin(), candidates.end(), i) == candidates.end()) {
          candidates.push_back(i);
        }
      }
    }
    best_pair_ = {};
    for (std::size_t a = 0; a < candidates.size(); ++a) {
      for (std::size_t b = a + 1; b < candidates.size(); ++b) {
        HypothesisFit fit = fitter_.fit(set_, {candidates[a], candidates[b]});
        fit.forget_readings();
        if (fit.fitted && (!best_pair_.fitted || fit.total() < best_pair_.total())) {
          best_pair_ = std::move(fit);
          pair_ = {candidates[a], candidates[b]};
        }
      }
    }
  }

  // Whether the axes' noise clearly differs once the worst readings are out; all fits anew then.
  void weigh_axes() {
    const HypothesisFit& clean = best_pair_.fitted ? best_pair_ : deletions_[by_deletion_.front()];
    if (!clean.fitted || !(equality_p_value(clean) < unequal_below)) {
      return;
    }
    unequal_ = true;
    const Eigen::VectorXd own =
        (clean.rss.array() / clean.degrees_of_freedom.array().max(0.5)).sqrt();
    fitter_ = HypothesisFitter(clean.fields, fitter_.known_field(),
                               fitter_.scale().cwiseProduct(own / own.maxCoeff()));
    plain_ = fitter_.fit(set_);
    if (plain_.fitted) {
      delete_each();
      delete_pairs();
    }
  }

  // A noisy axis looks like a mistake in a few of its readings. What may be that counts less: where
  // the scatters of the axes differ (`equality`, before the hypothesis), and where it takes its sum
  // of squares from an axis that scatters more than the others even after it. Tuned (MC) so that
  // good runs with noise 1 : 1 : 3 are called bad in 1 %.
  [[nodiscard]] double allowance(const HypothesisFit& with, double equality, bool of_few) const {
    if (stated_ratio_) {
      return 1.0;
    }
    double own = 0.0;
    double drops = 0.0;
    for (Eigen::Index k = 0; k < m(); ++k) {
      const double drop = std::max(plain_.rss(k) - with.rss(k), 0.0);
      own += drop * with.rss(k) / std::max(with.degrees_of_freedom(k), 0.5);
      drops += drop;
    }
    const double pooled = with.total() / std::max(with.dof(), 0.5);
    const double noisy = drops > 0.0 && pooled > 0.0 ? own / drops / pooled : 1.0;
    const double unequal = of_few ? std::pow(std::max(1.0, 0.2 / std::max(equality, 1e-300)), 1.6)
                                  : std::max(1.0, 3e-4 / std::max(equality, 1e-300));
    constexpr double most = 1e3;  // no noise makes a mistake of many sigma
    return std::min(most, unequal * std::pow(std::max(1.0, noisy), 8.0));
  }

  [[nodiscard]] double nested_p(const HypothesisFit& with) const {
    return with.fitted ? f_test(plain_.total(), plain_.dof(), plain_.total() - with.total(),
                                plain_.dof() - with.dof())
                       : 1.0;
  }

  // Each axis by its own scatter, put together by Fisher's method.
  [[nodiscard]] double nested_p_by_axis(const HypothesisFit& with) const {
    if (!with.fitted) {
      return 1.0;
    }
    double sum = 0.0;
    for (Eigen::Index k = 0; k < m(); ++k) {
      const double p =
          f_test(plain_.rss(k), plain_.degrees_of_freedom(k), plain_.rss(k) - with.rss(k),
                 plain_.degrees_of_freedom(k) - with.degrees_of_freedom(k));
      sum -= 2.0 * std::log(std::max(p, 1e-300));
    }
    return chi_squared_upper_p(std::max(sum, 1e-12), 2.0 * static_cast<double>(m()));
  }

  [[nodiscard]] bool is_bad() {
    const double equality = stated_ratio_ ? 1.0 : equality_p_value(plain_);
    const auto readings = static_cast<double>(n());
    double smallest = 1.0;
    // @param tests  of that class; @param of_few  whether it is about a few readings.
    const auto consider = [&](const HypothesisFit& with, double tests, bool of_few) {
      if (with.fitted) {
        smallest = std::min(smallest, tests * allowance(with, equality, of_few) * nested_p(with));
      }
    };
    consider(deletions_[by_deletion_.front()], readings, true);
    for (const std::size_t i : first_of(by_deletion_, 3)) {
      consider(tilted(i), readings, true);
    }
    delete_pairs();
    constexpr double rare = 100.0;  // two independent mistakes
    consider(best_pair_, rare * 0.5 * readings * (readings - 1.0), true);
    for (const std::size_t cut : cuts()) {
      consider(table_moved(cut), 0.3 * (readings - 1.0), true);
    }
    consider(drifted(), 1.0, false);
    for (Eigen::Index k = 0; k < m(); ++k) {
      for (const bool top : {true, false}) {
        consider(saturated(k, top), 2.0 * static_cast<double>(m()), false);
      }
    }
    const bool bad = classes * smallest < false_alarm;
    if (!stated_ratio_) {
      weigh_axes();
    }
    if (bad || !unequal_ || !plain_.fitted) {
      return bad && plain_.fitted;
    }
    const double by_axis = std::min(readings * nested_p_by_axis(deletions_[by_deletion_.front()]),
                                    nested_p_by_axis(drifted()));
    return 2.0 * by_axis < false_alarm_by_axis;
  }

  // ---- columns ----

  // The field turned in the table for all readings behind a cut of the run's order.
  [[nodiscard]] Eigen::MatrixXd table_columns(std::size_t cut,
                                              const std::vector<Eigen::Vector3d>& fields,
                                              const Eigen::MatrixXd& coefficients) const {
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), 2);
    for (std::size_t at = cut; at < count(); ++at) {
      const std::size_t i = order_[at];
      const Eigen::MatrixXd rows = table_rows(i, fields, coefficients);
      for (Eigen::Index k = 0; k < m(); ++k) {
        Z.row(n() * k + static_cast<Eigen::Index>(i)) = rows.row(k);
      }
    }
    return Z;
  }

  // The rows of one reading in them, one for each axis.
  [[nodiscard]] Eigen::MatrixXd table_rows(std::size_t i,
                                           const std::vector<Eigen::Vector3d>& fields,
                                           const Eigen::MatrixXd& coefficients) const {
    const Eigen::Vector3d& field = fields[set_.level_of(static_cast<Eigen::Index>(i))];
    const Eigen::Matrix<double, 3, 2> change = set_.readings[i].level * field.norm() *
                                               set_.rotation_sensor_from_table[i] *
                                               tangents_of(field);
    return coefficients.middleRows<3>(1).transpose() * change;
  }

  [[nodiscard]] Eigen::MatrixXd drift_columns() const {
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), m());
    for (std::size_t at = 0; at < count(); ++at) {
      const double along =
          static_cast<double>(at) / std::max(1.0, static_cast<double>(n() - 1)) - 0.5;
      for (Eigen::Index k = 0; k < m(); ++k) {
        Z(n() * k + static_cast<Eigen::Index>(order_[at]), k) = along;
      }
    }
    return Z;
  }

  // The readings at one end of an axis's range.
  [[nodiscard]] std::vector<std::size_t> extremes(Eigen::Index axis,
                                                  bool top,
                                                  const HypothesisFit& fit) const {
    std::vector<double> sensed;
    const Eigen::MatrixXd base = field_design(set_, fit.fields);
    for (Eigen::Index i = 0; i < n(); ++i) {
      sensed.push_back((top ? 1.0 : -1.0) *
                       base.row(i).segment<3>(1).dot(fit.coefficients.col(axis).segment<3>(1)));
    }
    const double end = *std::max_element(sensed.begin(), sensed.end());
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < count(); ++i) {
      if (sensed[i] > 0.9 * end) {
        found.push_back(i);
      }
    }
    return found;
  }

  [[nodiscard]] Eigen::MatrixXd extreme_columns(Eigen::Index axis,
                                                bool top,
                                                const HypothesisFit& fit) const {
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), 1);
    for (const std::size_t i : extremes(axis, top, fit)) {
      Z(n() * axis + static_cast<Eigen::Index>(i), 0) = 1.0;
    }
    return Z;
  }

  [[nodiscard]] HypothesisFit table_moved(std::size_t cut) const {
    return fitter_.fit(
        set_, {}, [&, cut](const std::vector<Eigen::Vector3d>& fields, const Eigen::MatrixXd& c) {
          return table_columns(cut, fields, c);
        });
  }

  [[nodiscard]] HypothesisFit drifted() const {
    return fitter_.fit(set_, {}, [&](const auto&, const auto&) { return drift_columns(); });
  }

  [[nodiscard]] HypothesisFit saturated(Eigen::Index axis, bool top) const {
    const Eigen::MatrixXd Z = extreme_columns(axis, top, plain_);
    return fitter_.fit(set_, {}, [&](const auto&, const auto&) { return Z; });
  }

  [[nodiscard]] HypothesisFit tilted(std::size_t i) const {
    const auto row = static_cast<Eigen::Index>(i);
    if (set_.readings[i].level == 0.0) {
      return {};  // no field, no tilt in it
    }
    return fitter_.fit(set_, {},
                       [&, i, row](const std::vector<Eigen::Vector3d>& fields,
                                   const Eigen::MatrixXd& c) -> Eigen::MatrixXd {
                         const Eigen::Vector3d field =
                             set_.rotation_sensor_from_table[i] * set_.field_in_table(row, fields);
                         Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), 2);
                         const Eigen::Matrix<double, 3, 2> change =
                             field.norm() * tangents_of(field);
                         for (Eigen::Index k = 0; k < m(); ++k) {
                           Z.row(n() * k + row) = c.col(k).segment<3>(1).transpose() * change;
                         }
                         return Z;
                       });
  }

  // A value for each of these readings, or for one of its axes, that may be anything.
  [[nodiscard]] HypothesisFit arbitrary(const std::vector<std::size_t>& readings,
                                        std::optional<Eigen::Index> axis = {}) const {
    std::vector<Eigen::Index> rows = rows_of(readings);
    if (axis) {
      rows = {n() * *axis + static_cast<Eigen::Index>(readings.front())};
    }
    Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(n() * m(), static_cast<Eigen::Index>(rows.size()));
    for (std::size_t j = 0; j < rows.size(); ++j) {
      Z(rows[j], static_cast<Eigen::Index>(j)) = 1.0;
    }
    return fitter_.fit(set_, {}, [&](const auto&, const auto&) { return Z; });
  }

  // ---- explanations ----

  // @param ranges        of the added parameters.
  // @param alternatives  of that kind.
  [[nodiscard]] double likelihood(const HypothesisFit& fit,
                                  const std::vector<double>& ranges,
                                  double alternatives) const {
    const double nu = fit.dof();
    double value = -0.5 * nu * std::log(fit.total()) + std::lgamma(0.5 * nu);
    for (std::size_t q = 0; q < ranges.size(); ++q) {
      value += 0.5 * std::log(std::numbers::pi / fit.information(static_cast<Eigen::Index>(q))) -
               std::log(ranges[q]);
    }
    return value - std::log(alternatives);
  }

  void add(HypothesisFit fit,
           const std::vector<double>& ranges,
           double alternatives,
           Correction correction,
           std::string words) {
    if (!fit.fitted || !(fit.dof() >= 1.0)) {
      return;
    }
    Explanation explanation{.likelihood = likelihood(fit, ranges, alternatives),
                            .fit = std::move(fit),
                            .correction = std::move(correction),
                            .words = std::move(words)};
    explanation.fit.forget_readings();
    explanations_.push_back(std::move(explanation));
  }

  [[nodiscard]] std::vector<double> value_ranges(Eigen::Index repeats = 1) const {
    std::vector<double> ranges;
    for (Eigen::Index k = 0; k < m(); ++k) {
      ranges.insert(ranges.end(), static_cast<std::size_t>(repeats),
                    value_range * full_response(k));
    }
    return ranges;
  }

  void explain() {
    constexpr std::size_t most_suspects = 6;
    const std::vector<std::size_t> suspects = first_of(by_deletion_, most_suspects);
    for (const std::size_t i : suspects) {
      explain_by_pose(i);
      explain_by_value(i);
      explain_by_level(i);
      explain_by_repeat(i);
      explain_by_tilt(i);
    }
    explain_by_exchange();
    explain_by_two();
    explain_by_table();
    explain_by_drift();
    explain_by_saturation();
    std::stable_sort(
        explanations_.begin(), explanations_.end(),
        [](const Explanation& a, const Explanation& b) { return a.likelihood > b.likelihood; });
  }

  [[nodiscard]] Correction about(std::string code, const std::vector<std::size_t>& readings) const {
    Correction correction{.code = std::move(code)};
    for (const std::size_t i : readings) {
      correction.runs.push_back(run_of(i));
    }
    return correction;
  }

  void explain_by_pose(std::size_t i) {
    const DesignPoint& stated = *set_.readings[i].point;
    const HypothesisFit& without = deletions_[i];
    if (!without.fitted) {
      return;
    }
    const auto row = static_cast<Eigen::Index>(i);
    // Those poses are fitted that the other readings say are near.
    std::vector<std::pair<double, DesignPoint>> poses;
    for (const DesignEntry& entry : standard_design(24)) {
      if (entry.point == stated) {
        continue;
      }
      ReadingSet moved = one_reading(i);
      try {
        moved.rotation_sensor_from_table = {set_.orientation(entry.point)};
      } catch (const std::exception&) {
        continue;  // the cube cannot lie so
      }
      poses.emplace_back(distance_squared(moved, without, set_.response.row(row)), entry.point);
    }
    std::stable_sort(poses.begin(), poses.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    constexpr std::size_t near = 3;
    for (std::size_t at = 0; at < std::min(near, poses.size()); ++at) {
      const DesignPoint& point = poses[at].second;
      ReadingSet set = set_;
      set.readings[i].point = point;
      set.rotation_sensor_from_table[i] = set_.orientation(point);
      Correction correction = about("wrong_pose", {i});
      correction.points = {{run_of(i), point}};
      const bool is_odd =
          std::any_of(set_.readings.begin(), set_.readings.end(),
                      [&](const Reading& reading) {
                        return reading.block == set_.readings[i].block && reading.point == point;
                      }) ||
          std::none_of(set_.readings.begin(), set_.readings.end(), [&](const Reading& reading) {
            return reading.block == set_.readings[i].block && reading.point == point.turned_round();
          });
      // On a level table the fence face shows little; the point that the run lacks, whose opposite
      // is there, is likelier.
      const double alternatives = (is_odd ? 23.0 * repeated_point : 23.0);
      add(fitter_.fit(set), {}, alternatives * static_cast<double>(n()), std::move(correction),
          "as " + pose_words(stated, point));
    }
  }

  // "rest -Y instead of +Y", "fence -Z instead of +Z, turned round".
  [[nodiscard]] static std::string pose_words(const DesignPoint& stated, const DesignPoint& point) {
    const auto face = [](Face f) { return std::string(face_name(f)); };
    const bool same_rest = stated.rest() == point.rest();
    const bool same_fence = stated.fence() == point.fence();
    if (same_fence) {
      return "rest " + face(point.rest()) + " instead of " + face(stated.rest()) +
             (axis_of(point.rest()) == axis_of(stated.rest()) ? " (upside down)" : "");
    }
    if (same_rest) {
      return "fence " + face(point.fence()) + " instead of " + face(stated.fence()) +
             (axis_of(point.fence()) == axis_of(stated.fence()) ? " (the wrong way round)" : "");
    }
    return "rest " + face(point.rest()) + ", fence " + face(point.fence()) + " instead of rest " +
           face(stated.rest()) + ", fence " + face(stated.fence());
  }

  [[nodiscard]] ReadingSet one_reading(std::size_t i) const {
    ReadingSet one = set_;
    const auto row = static_cast<Eigen::Index>(i);
    one.readings = {set_.readings[i]};
    one.response = set_.response.row(row);
    one.weights = set_.weights.row(row);
    one.rotation_sensor_from_table = {set_.rotation_sensor_from_table[i]};
    if (!set_.levels.empty()) {
      one.levels = {set_.levels[i]};
    }
    if (set_.temperature.order > 0) {
      one.temperature.d = set_.temperature.d.segment(row, 1);
      one.temperature.soak = {set_.soak_of(i)};
    }
    return one;
  }

  // How far a response lies from what the other readings say, in the scale of its axes, squared.
  [[nodiscard]] double distance_squared(const ReadingSet& one,
                                        const HypothesisFit& without,
                                        const Eigen::VectorXd& response) const {
    const Eigen::MatrixXd base = field_design(one, without.fields);
    double distance = 0.0;
    for (Eigen::Index k = 0; k < m(); ++k) {
      const double expected =
          one.with_temperature(base, k).row(0).dot(without.coefficients.col(k).transpose());
      distance += std::pow((response(k) - expected) / fitter_.scale()(k), 2);
    }
    return distance;
  }

  void try_value(std::size_t i,
                 const Eigen::VectorXd& value,
                 double alternatives,
                 const std::string& code,
                 const std::string& words) {
    const HypothesisFit& without = deletions_[i];
    if (!without.fitted) {
      return;
    }
    const auto row = static_cast<Eigen::Index>(i);
    // Of many readings only what comes near to what the others say is worth a fit.
    if (count() > each_is_fitted) {
      const ReadingSet one = one_reading(i);
      const Eigen::VectorXd stated = set_.response.row(row);
      if (distance_squared(one, without, value) > 0.25 * distance_squared(one, without, stated)) {
        return;
      }
    }
    ReadingSet set = set_;
    set.response.row(row) = value;
    Correction correction = about(code, {i});
    correction.responses = {{run_of(i), value}};
    add(fitter_.fit(set), {}, alternatives, std::move(correction), words);
  }

  void explain_by_value(std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd v = set_.response.row(row);
    const auto readings = static_cast<double>(n());
    const auto axis_name = [&](Eigen::Index k) { return set_.axes[static_cast<std::size_t>(k)]; };
    if (m() > 1 && m() <= 4) {
      std::vector<Eigen::Index> order(static_cast<std::size_t>(m()));
      std::iota(order.begin(), order.end(), 0);
      double permutations = 1.0;
      for (Eigen::Index k = 2; k <= m(); ++k) {
        permutations *= static_cast<double>(k);
      }
      while (std::next_permutation(order.begin(), order.end())) {
        std::string names;
        for (const Eigen::Index k : order) {
          names += (names.empty() ? "" : ", ") + axis_name(k);
        }
        try_value(i, v(order), readings * (permutations - 1.0), "columns_exchanged",
                  "with its columns in the order " + names);
      }
    }
    if (m() <= 4) {
      const int subsets = (1 << m()) - 1;
      for (int subset = 1; subset <= subsets; ++subset) {
        Eigen::VectorXd turned = v;
        std::string names;
        for (Eigen::Index k = 0; k < m(); ++k) {
          if ((subset & (1 << k)) != 0) {
            turned(k) = -v(k);
            names += (names.empty() ? "" : ", ") + axis_name(k);
          }
        }
        try_value(i, turned, readings * subsets, "sign", "with the sign of " + names + " reversed");
      }
    }
    const auto kinds = 4.0 * static_cast<double>(m() > 1 ? 1 + m() : 1);
    for (const double factor : {1e3, 1e-3, standard_gravity, 1.0 / standard_gravity}) {
      const std::string text = number_text(factor > 1.0 ? factor : 1.0 / factor);
      const std::string words = factor > 1.0 ? "divided by " + text + " (another unit)"
                                             : "times " + text + " (another unit)";
      try_value(i, v / factor, readings * kinds, "unit_factor", words);
      for (Eigen::Index k = 0; k < m() && m() > 1; ++k) {
        Eigen::VectorXd one = v;
        one(k) /= factor;
        try_value(i, one, readings * kinds, "unit_factor", "with " + axis_name(k) + " " + words);
      }
    }
    for (Eigen::Index k = 0; k < m() && m() > 1; ++k) {
      Correction correction = about("outlier", {i});
      correction.leave_out = correction.runs;
      add(arbitrary({i}, k), {value_range * full_response(k)}, readings * static_cast<double>(m()),
          std::move(correction), "without axis " + axis_name(k));
    }
    Correction correction = about("outlier", {i});
    correction.leave_out = correction.runs;
    add(arbitrary({i}), value_ranges(), readings, std::move(correction), "without it");
  }

  void explain_by_level(std::size_t i) {
    std::set<double> levels;
    for (const Reading& reading : set_.readings) {
      levels.insert(reading.level);
    }
    if (!set_.level_can_be_set || (levels.size() == 1 && *levels.begin() == 1.0)) {
      return;
    }
    levels.insert({-1.0, 0.0, 1.0});
    for (const double level : levels) {
      if (level == set_.readings[i].level) {
        continue;
      }
      ReadingSet set = set_;
      set.readings[i].level = level;
      Correction correction = about("wrong_level", {i});
      correction.levels = {{run_of(i), level}};
      add(fitter_.fit(set), {}, static_cast<double>(n()) * static_cast<double>(levels.size() - 1),
          std::move(correction),
          "at level " + number_text(level) + " instead of " + number_text(set_.readings[i].level));
    }
  }

  // A value repeated to the last digit in another pose tells nothing of its reading.
  void explain_by_repeat(std::size_t i) {
    const auto row = static_cast<Eigen::Index>(i);
    std::size_t said = 0;
    for (std::size_t j = 0; j < count() && m() > 1 && said < most_said; ++j) {
      const auto other = static_cast<Eigen::Index>(j);
      if (i == j || *set_.readings[i].point == *set_.readings[j].point ||
          set_.response.row(row) != set_.response.row(other)) {
        continue;
      }
      Correction correction = about("stuck", {i});
      correction.leave_out = correction.runs;
      ++said;
      add(deletions_[i], {}, static_cast<double>(n()), std::move(correction),
          "without it: it repeats run " + std::to_string(run_of(j)) + " to the last digit");
      // Nothing else makes all digits the same.
      if (!explanations_.empty() && explanations_.back().correction.code == "stuck") {
        explanations_.back().likelihood += sure;
      }
    }
  }

  void explain_by_tilt(std::size_t i) {
    Correction correction = about("tilted_seat", {i});
    correction.leave_out = correction.runs;
    add(tilted(i), {angle_range_rad, angle_range_rad}, static_cast<double>(n()),
        std::move(correction), "with its seat tilted");
  }

  void explain_by_exchange() {
    constexpr std::size_t few = 16;
    const std::vector<std::size_t> candidates = count() <= few ? order_ : [&] {
      std::vector<std::size_t> some = largest_residuals(few / 2);
      for (const std::size_t i : first_of(by_deletion_, few / 2)) {
        if (std::find(some.begin(), some.end(), i) == some.end()) {
          some.push_back(i);
        }
      }
      return some;
    }();
    const auto pairs = 0.5 * static_cast<double>(n()) * static_cast<double>(n() - 1);
    for (std::size_t a = 0; a < candidates.size(); ++a) {
      for (std::size_t b = a + 1; b < candidates.size(); ++b) {
        const std::size_t i = std::min(candidates[a], candidates[b]);
        const std::size_t j = std::max(candidates[a], candidates[b]);
        const DesignPoint& first = *set_.readings[i].point;
        const DesignPoint& second = *set_.readings[j].point;
        if (first == second) {
          continue;
        }
        ReadingSet set = set_;
        set.response.row(static_cast<Eigen::Index>(i)) =
            set_.response.row(static_cast<Eigen::Index>(j));
        set.response.row(static_cast<Eigen::Index>(j)) =
            set_.response.row(static_cast<Eigen::Index>(i));
        Correction correction = about("exchanged", {i, j});
        correction.responses = {{run_of(i), set_.response.row(static_cast<Eigen::Index>(j))},
                                {run_of(j), set_.response.row(static_cast<Eigen::Index>(i))}};
        add(fitter_.fit(set), {}, pairs, std::move(correction),
            std::string("with their readings exchanged") +
                (first.turned_round() == second ? " (or both the wrong way round)" : ""));
      }
    }
  }

  void explain_by_two() {
    if (!best_pair_.fitted) {
      return;
    }
    const auto pairs = 0.5 * static_cast<double>(n()) * static_cast<double>(n() - 1);
    Correction correction = about("outlier", {pair_[0], pair_[1]});
    std::sort(correction.runs.begin(), correction.runs.end());
    correction.leave_out = correction.runs;
    add(arbitrary({pair_[0], pair_[1]}), value_ranges(2), pairs, std::move(correction),
        "without them");
  }

  void explain_by_table() {
    if (fitter_.known_field()) {
      return;
    }
    for (const std::size_t cut : cuts()) {
      Correction correction = about("table_moved", {order_[cut - 1], order_[cut]});
      add(table_moved(cut), {angle_range_rad, angle_range_rad}, static_cast<double>(n() - 1),
          std::move(correction), "with the table moved between them");
    }
  }

  void explain_by_drift() {
    std::vector<double> ranges;
    for (Eigen::Index k = 0; k < m(); ++k) {
      ranges.push_back(drift_range * full_response(k));
    }
    add(drifted(), ranges, 1.0, Correction{.code = "drift"},
        "with a drift of the bias over the run");
  }

  void explain_by_saturation() {
    for (Eigen::Index k = 0; k < m(); ++k) {
      for (const bool top : {true, false}) {
        const std::vector<std::size_t> readings = extremes(k, top, plain_);
        Correction correction = about("saturated", readings);
        add(saturated(k, top), {drift_range * full_response(k)}, 2.0 * static_cast<double>(m()),
            std::move(correction),
            std::string("with axis ") + set_.axes[static_cast<std::size_t>(k)] +
                (top ? " limited at its upper end" : " limited at its lower end"));
      }
    }
  }

  // ---- words ----

  [[nodiscard]] static std::string advice_of(const Correction& correction) {
    const std::string& code = correction.code;
    if (code == "wrong_pose") {
      return "Check the face, or take the reading again.";
    }
    if (code == "exchanged") {
      return "Check which reading is which, or take both again.";
    }
    if (code == "wrong_level") {
      return "Check what the field was set to, or take the reading again.";
    }
    if (code == "stuck") {
      return "Take the reading again.";
    }
    if (code == "tilted_seat") {
      return "Look for grit under a foot and a fence not touched, and take the reading again.";
    }
    if (code == "table_moved") {
      return "See that nothing moves the table, and take all readings again, or give each part its "
             "own block and --level-by block.";
    }
    if (code == "drift") {
      return "Let the instrument warm up, and take the readings in random order.";
    }
    if (code == "saturated") {
      return "State its --range, or use a range that holds the field; a curved response looks the "
             "same.";
    }
    if (code == "outlier") {
      return correction.runs.size() > 1 ? "Take these readings again." : "Take the reading again.";
    }
    return "Correct it, or take the reading again.";
  }

  [[nodiscard]] double times_better(const HypothesisFit& fit) const {
    return std::sqrt((plain_.total() / plain_.dof()) / (fit.total() / fit.dof()));
  }

  [[nodiscard]] std::string better(const HypothesisFit& fit) const {
    const double ratio = times_better(fit);
    return number_text(ratio, ratio < 100.0 ? 2 : static_cast<int>(std::log10(ratio)) + 1);
  }

  [[nodiscard]] std::string sentence(const Explanation& explanation) const {
    const Correction& correction = explanation.correction;
    const std::string who =
        correction.runs.empty() ? std::string("the run") : name_of_runs(correction.runs);
    const bool one = correction.runs.size() < 2;
    return who + (one ? ": fits " : ": fit ") + better(explanation.fit) + " times better " +
           explanation.words + ". " + advice_of(correction);
  }

  // A tilt of the first reading is the table moved after it, and one of the last moved before it.
  [[nodiscard]] bool same_data(const Explanation& a, const Explanation& b) const {
    const double difference = std::abs(a.fit.total() / b.fit.total() - 1.0);
    return difference < 1e-6;
  }

  [[nodiscard]] std::optional<Culprit> culprit() const {
    if (explanations_.empty()) {
      return std::nullopt;
    }
    const Explanation& best = explanations_.front();
    // By whichever axis the run looks bad: without a fit that is clearly better nothing is
    // explained.
    constexpr double clearly_better = 1.15;
    if (!(times_better(best.fit) > clearly_better)) {
      return std::nullopt;
    }
    Culprit result;
    std::set<std::vector<int>> seen_outliers;
    for (const Explanation& explanation : explanations_) {
      const double behind = best.likelihood - explanation.likelihood;
      const bool twin = same_data(best, explanation) && behind < 3.0 * as_likely;
      if (&explanation != &best && !(behind < as_likely) && !twin) {
        continue;
      }
      if (result.warnings.size() == most_said ||
          !(times_better(explanation.fit) > clearly_better)) {
        break;
      }
      // The same reading said to be an outlier in several ways is said once.
      if (explanation.correction.code == "outlier" &&
          !seen_outliers.insert(explanation.correction.runs).second) {
        continue;
      }
      std::string message = sentence(explanation);
      if (&explanation != &best) {
        const double ratio = std::exp(behind);
        message = "or " + message + " (" +
                  (ratio < 1.05 ? std::string("as likely")
                                : number_text(ratio, 2) + " times less likely") +
                  ")";
      }
      result.warnings.push_back({.code = explanation.correction.code,
                                 .runs = explanation.correction.runs,
                                 .message = std::move(message)});
    }
    result.correction = best.correction;
    result.correction.message = result.warnings.front().message;
    for (Eigen::Index k = 0; k < m(); ++k) {
      const Eigen::Vector4d change =
          best.fit.coefficients.col(k).head<4>() - plain_.coefficients.col(k).head<4>();
      const double F = plain_.fields.front().norm();
      result.effect = std::max({result.effect, std::abs(change(0)) / full_response(k),
                                change.tail<3>().norm() * F / full_response(k)});
    }
    return result;
  }

  static constexpr std::size_t most_said = 3;
  static constexpr double sure = 200.0;
  static constexpr double repeated_point = 5.0;

  const ReadingSet& set_;
  HypothesisFitter fitter_;
  std::vector<std::size_t> order_;  // of the readings, as they were taken
  HypothesisFit plain_;
  std::vector<HypothesisFit> deletions_;  // of each reading; not fitted where it counts too little
  std::vector<std::size_t> by_deletion_;  // positions, the one that mends most first
  HypothesisFit best_pair_;
  std::array<std::size_t, 2> pair_{};
  bool stated_ratio_;
  bool unequal_ = false;
  std::vector<Explanation> explanations_;
};

}  // namespace

bool can_be_searched(const ReadingSet& set, const Estimate& estimate) {
  const bool labelled =
      set.rotation_sensor_from_table.size() == set.readings.size() && !estimate.fields.empty();
  return labelled && !set.is_sum() && !set.robust && !set.leaves_out() &&
         set.also_in_table.empty() && set.size() >= 6;
}

std::optional<Culprit> find_culprit(const ReadingSet& set,
                                    const Estimate& estimate,
                                    bool known_field) {
  // A direction that was stated wrongly is no mistake of a reading: where opposite readings show it
  // they are judged without it.
  return Search(set, estimate, known_field && !estimate.levelness).run();
}

Observations corrected(Observations observations, const Correction& correction) {
  for (std::size_t i = 0; i < observations.readings.size(); ++i) {
    Reading& reading = observations.readings[i];
    for (const auto& [run, point] : correction.points) {
      if (run == reading.run) {
        reading.point = point;
      }
    }
    for (const auto& [run, level] : correction.levels) {
      if (run == reading.run) {
        reading.level = level;
      }
    }
    for (const auto& [run, response] : correction.responses) {
      if (run == reading.run) {
        observations.response.row(static_cast<Eigen::Index>(i)) = response;
      }
    }
  }
  return observations;
}

}  // namespace axiscal
