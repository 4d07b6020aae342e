// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/field_description.hpp"
#include "axiscal/field/field_level.hpp"

namespace axiscal {

/// The field in the table at each reading: the parts of a sum, the levels of the readings, the
/// number of tilts of the table, and the vectors. All fitted field quantities are accessed through
/// this class.
///
/// The vectors are, frame table [unit of the field], of a sum those of its parts at level 1; else
/// one for each tilt. A sum has one tilt. A field whose vectors are not known yet, or that the
/// readings bring, has none. Copies share what does not change.
class AXISCAL_EXPORT TableField {
 public:
  using Tangents = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /// One field that the level multiplies, on a table that stays as it is; without vectors.
  TableField();

  /// @param parts  one or more. A single one is multiplied by the level, which is 1 where it cannot
  ///               be set.
  /// @throws DomainError  if there are none.
  explicit TableField(std::vector<FieldDescription> parts);

  /// @return the same field where each block has its own tilt; without vectors.
  /// @param blocks  their numbers, ascending, one or more.
  [[nodiscard]] TableField tilted_by_block(std::vector<int> blocks) const;

  /// @return the same field with these vectors.
  /// @throws DomainError  unless the size is vector_count().
  [[nodiscard]] TableField with(std::vector<Eigen::Vector3d> vectors) const;

  /// @return the same field with this vector for every tilt.
  [[nodiscard]] TableField with_all(const Eigen::Vector3d& vector) const;

  /// @return the same field where its parts are stated to lie; a part of which no direction is
  ///         stated along z, one of unknown magnitude as long as the longest that is known.
  [[nodiscard]] TableField as_stated() const;

  /// @return the same field without vectors.
  [[nodiscard]] TableField without_vectors() const;

  [[nodiscard]] bool is_sum() const { return parts().size() > 1; }
  [[nodiscard]] const std::vector<FieldDescription>& parts() const { return layout_->parts; }

  /// @return true if a part rotates the table, so that the sum is not linear in the other parts.
  [[nodiscard]] bool turns() const;

  /// @return whether some part is made on the table, so that other levels can be asked for.
  [[nodiscard]] bool level_can_be_set() const { return layout_->level_can_be_set; }

  /// @return the block that each tilt is of.
  [[nodiscard]] const std::vector<int>& blocks() const { return layout_->blocks; }

  /// @return the tilt of a block; 0 for one that has none of its own.
  [[nodiscard]] std::size_t tilt_of_block(int block) const;

  /// @return the number of vectors after the fit.
  [[nodiscard]] std::size_t vector_count() const {
    return is_sum() ? parts().size() : blocks().size();
  }

  /// @return true if the magnitude of a vector is unknown and is fitted.
  [[nodiscard]] bool has_free_length(std::size_t which) const {
    return is_sum() && parts()[which].free_length;
  }

  [[nodiscard]] bool has_vectors() const { return !vectors_.empty(); }

  /// @return the number of known vectors.
  [[nodiscard]] std::size_t size() const { return vectors_.size(); }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& vectors() const { return vectors_; }
  [[nodiscard]] const Eigen::Vector3d& vector(std::size_t which) const { return vectors_[which]; }

  /// @return length of the first vector, of a field without a sum F.
  [[nodiscard]] double magnitude() const { return vectors_.front().norm(); }

  /// @return the field of the whole run at level 1: a sum's, else the mean direction of the tilts.
  [[nodiscard]] Eigen::Vector3d mean() const;

  /// @return "the field", "the field geomagnetic", "the field in block 2".
  [[nodiscard]] std::string name_of(std::size_t which) const;

  /// @return the factor by which a level multiplies a part.
  [[nodiscard]] double factor_of(std::size_t part, const FieldLevel& level) const {
    return parts()[part].set_by_level ? level.of(parts()[part].level_name()) : 1.0;
  }

  /// @return true if the field is zero at this level, as with a dark lamp.
  [[nodiscard]] bool is_dark(const FieldLevel& level) const;

  /// @return the field of a reading at a level, frame table.
  [[nodiscard]] Eigen::Vector3d at(const FieldLevel& level, std::size_t tilt = 0) const;

  /// @return its derivative with respect to one of the vectors, 3 x 3.
  [[nodiscard]] Eigen::Matrix3d change(const FieldLevel& level,
                                       std::size_t tilt,
                                       std::size_t which) const;

  /// @return the derivative of the mean of the tilts, or of a sum at level 1, with respect to one
  ///         of the vectors.
  [[nodiscard]] Eigen::Matrix3d change_of_mean(std::size_t which) const;

  /// The directions in which each vector is open, of length 1: two across it; all three where its
  /// magnitude is not known, so that it may also vanish.
  [[nodiscard]] std::vector<Tangents> tangents() const;

  /// @return the change of a vector for a step of 1 along a tangent [unit of the field]: its
  ///         length; if that is unknown, the length of the longest known vector.
  [[nodiscard]] double step_unit(std::size_t which) const;

  /// The field after a step along its tangents: vectors turned by the two angles across them [rad],
  /// those of unknown magnitude moved in units of step_unit().
  /// @param tangents  as tangents() gave them.
  /// @param step      one entry for each of their columns, in their order.
  [[nodiscard]] TableField moved(const std::vector<Tangents>& tangents,
                                 const Eigen::VectorXd& step) const;

  /// @return the field with all its vectors reversed.
  [[nodiscard]] TableField reversed() const;

 private:
  struct Layout {
    std::vector<FieldDescription> parts;
    bool level_can_be_set = true;
    std::vector<int> blocks = {1};
  };

  // The part that the table turns about at a level; parts().size() where none does.
  [[nodiscard]] std::size_t turning_part(const FieldLevel& level) const;

  std::shared_ptr<const Layout> layout_;
  std::vector<Eigen::Vector3d> vectors_;
};

}  // namespace axiscal
