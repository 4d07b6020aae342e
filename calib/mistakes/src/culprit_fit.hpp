// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/joint_fit.hpp"

namespace axiscal {

// Within which a fit is linear: a turn of the fields, residuals as parts of the readings, what the
// next step would change, a millionth of the sum of squares, and how uncertain the directions are,
// times what each is by itself.
inline constexpr double small_turn_rad = 1e-3;
inline constexpr double small_residuals = 0.01;
inline constexpr double nothing = 1e-3;
inline constexpr double widest_of_linear = 10.0;

/// Orthonormal columns B that span those of a fit, with B B^T the hat matrix: each axis's own,
/// which no other has, then the shared. Rows go axis by axis.
class HatBasis {
 public:
  HatBasis() = default;

  /// @param own     of each axis n x p; axes alike have one in common.
  /// @param shared  (n m) x s.
  HatBasis(std::vector<std::shared_ptr<const Eigen::MatrixXd>> own, Eigen::MatrixXd shared)
      : own_(std::move(own)), shared_(std::move(shared)) {}

  /// @return how many columns there are.
  [[nodiscard]] Eigen::Index cols() const;

  /// @return the entry of two rows in the hat matrix.
  [[nodiscard]] double hat(Eigen::Index axis,
                           Eigen::Index reading,
                           Eigen::Index other_axis,
                           Eigen::Index other_reading) const;

  /// @return its diagonal; n x m.
  [[nodiscard]] Eigen::MatrixXd leverage() const;

  /// @return B^T Z; cols() x c.
  [[nodiscard]] Eigen::MatrixXd products_with(const Eigen::MatrixXd& Z) const;

  /// Adds to such products those of one row of Z.
  void add_product(Eigen::Index axis,
                   Eigen::Index reading,
                   const Eigen::Ref<const Eigen::RowVectorXd>& z,
                   Eigen::MatrixXd& products) const;

  /// @return the shared columns, each axis's rows times a factor; no longer orthonormal.
  [[nodiscard]] Eigen::MatrixXd shared_times(const Eigen::VectorXd& factors) const;

  /// @return the same own columns with other shared ones.
  [[nodiscard]] HatBasis with(Eigen::MatrixXd shared) const { return {own_, std::move(shared)}; }

 private:
  [[nodiscard]] const Eigen::MatrixXd& own_of(Eigen::Index axis) const {
    return *own_[static_cast<std::size_t>(axis)];
  }
  [[nodiscard]] Eigen::Index axes() const { return static_cast<Eigen::Index>(own_.size()); }
  [[nodiscard]] Eigen::Index readings() const { return own_.front()->rows(); }
  [[nodiscard]] Eigen::Index width() const { return own_.front()->cols(); }

  std::vector<std::shared_ptr<const Eigen::MatrixXd>> own_;
  Eigen::MatrixXd shared_;
};

/// What a hypothesis about the readings leaves: sums of squares and what they are judged by.
struct HypothesisFit {
  bool fitted = false;
  TableField field;
  Eigen::MatrixXd coefficients;        // p x m
  Eigen::VectorXd rss;                 // one for each axis, as weighted
  Eigen::VectorXd degrees_of_freedom;  // one for each axis
  Eigen::VectorXd information;         // on each added parameter, at unit noise
  Eigen::VectorXd added;               // their estimates
  Eigen::MatrixXd residuals;           // n x m, weighted
  HatBasis basis;
  Eigen::MatrixXd turns;  // of a fit without added columns: what its shared ones turn the fields by

  /// Frees what is kept for each reading; the sums, the fields and the coefficients stay.
  void forget_readings() {
    residuals.resize(0, 0);
    basis = {};
  }

  [[nodiscard]] double total() const { return rss.sum(); }
  [[nodiscard]] double dof() const { return degrees_of_freedom.sum(); }
};

/// Columns that a hypothesis adds to the model, (n m) x q, axis by axis, not weighted.
/// @param coefficients  p x m.
using AddedColumns =
    std::function<Eigen::MatrixXd(const TableField& field, const Eigen::MatrixXd& coefficients)>;

/// Fits the readings of a set under hypotheses about them: all readings, the field's direction
/// unknown or given. Axes count as their scale says.
class HypothesisFitter {
 public:
  /// @param fields       where to start, or as given.
  /// @param known_field  whether the directions are given.
  /// @param scale        m: what an axis's residuals are divided by.
  HypothesisFitter(TableField field, bool known_field, Eigen::VectorXd scale)
      : field_(std::move(field)), known_field_(known_field), scale_(std::move(scale)) {}

  /// @param given    the readings as the hypothesis has them.
  /// @param without  readings that are left out, by position.
  /// @param added    columns of the hypothesis; may be empty.
  /// @return not fitted, where the readings do not determine it.
  [[nodiscard]] HypothesisFit fit(const ReadingSet& given,
                                  const std::vector<std::size_t>& without = {},
                                  const AddedColumns& added = {}) const;

  /// @return the same from a fit of this one's on, with each axis in the scale of its own scatter.
  [[nodiscard]] HypothesisFitter by_scatter_of(const HypothesisFit& fit) const;

  /// The fit of all readings of a set once more, in this one's scales; its field and coefficients
  /// are those that it is linear about.
  /// @param fit   of all of them.
  /// @param whose what made it.
  [[nodiscard]] HypothesisFit again(const ReadingSet& set,
                                    const HypothesisFit& fit,
                                    const HypothesisFitter& whose) const;

  [[nodiscard]] const Eigen::VectorXd& scale() const { return scale_; }
  [[nodiscard]] bool known_field() const { return known_field_; }
  void start_at(TableField field) { field_ = std::move(field); }

 private:
  [[nodiscard]] Eigen::MatrixXd roots_of_weights(const ReadingSet& set,
                                                 const std::vector<std::size_t>& without) const;
  void describe(const ReadingSet& set, const Eigen::MatrixXd& root, HypothesisFit& result) const;

  TableField field_;
  bool known_field_;
  Eigen::VectorXd scale_;
};

}  // namespace axiscal
