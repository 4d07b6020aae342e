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

/// The field in the table's frame as a function of a reading's level and block. It consists of the
/// descriptions of the field's parts, the tilts of the table, and the vectors of the field. A tilt
/// is the slope of the table during the run, or during one block. All fitted field quantities are
/// accessed through this class.
///
/// The vectors are the field at level 1, in the table's frame [unit of the field]. A sum has one
/// vector for each part, and one tilt. A field of one part has one vector for each tilt. There are
/// no vectors if they are not known yet, or if each reading states its field. Copies share the
/// parts and tilts.
class AXISCAL_EXPORT TableField {
 public:
  using Tangents = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /// A single field that is multiplied by the level. It has one tilt and no vectors.
  TableField();

  /// @param parts  at least one part. A single part is always multiplied by the level. If that part
  ///               is local, all readings have level 1.
  /// @throws DomainError  if `parts` is empty.
  explicit TableField(std::vector<FieldDescription> parts);

  /// @return this field with a tilt for each block, without vectors.
  /// @param blocks  identifiers of the blocks, ascending, at least one.
  [[nodiscard]] TableField tilted_by_block(std::vector<int> blocks) const;

  /// @return this field with these vectors.
  /// @throws DomainError  unless `vectors` has vector_count() entries.
  [[nodiscard]] TableField with(std::vector<Eigen::Vector3d> vectors) const;

  /// @return this field with the same vector for every part or tilt.
  [[nodiscard]] TableField with_all(const Eigen::Vector3d& vector) const;

  /// @return this field with the vectors that are stated for its parts. If no direction is stated
  ///         for a part, its vector is along z. If its magnitude is unknown, the vector gets the
  ///         greatest known magnitude of the parts.
  [[nodiscard]] TableField as_stated() const;

  /// @return this field without vectors.
  [[nodiscard]] TableField without_vectors() const;

  [[nodiscard]] bool is_sum() const { return parts().size() > 1; }
  [[nodiscard]] const std::vector<FieldDescription>& parts() const { return layout_->parts; }

  /// @return true if a part is the rotation of a turntable. The sum is then a nonlinear function of
  ///         the vectors.
  [[nodiscard]] bool turns() const;

  /// @return true if a part is induced, so that readings can have different levels.
  [[nodiscard]] bool level_can_be_set() const { return layout_->level_can_be_set; }

  /// @return the identifiers of the blocks, one for each tilt.
  [[nodiscard]] const std::vector<int>& blocks() const { return layout_->blocks; }

  /// @return the index of a block's tilt; 0 if the block does not have its own tilt.
  [[nodiscard]] std::size_t tilt_of_block(int block) const;

  /// @return the number of vectors that the field has when they are known.
  [[nodiscard]] std::size_t vector_count() const {
    return is_sum() ? parts().size() : blocks().size();
  }

  /// @return true if the magnitude of a vector is unknown and is fitted.
  [[nodiscard]] bool has_free_length(std::size_t which) const {
    return is_sum() && parts()[which].free_length;
  }

  [[nodiscard]] bool has_vectors() const { return !vectors_.empty(); }

  /// @return the number of vectors: vector_count() if they are known, else 0.
  [[nodiscard]] std::size_t size() const { return vectors_.size(); }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& vectors() const { return vectors_; }
  [[nodiscard]] const Eigen::Vector3d& vector(std::size_t which) const { return vectors_[which]; }

  /// @return the length of the first vector, which is the magnitude of a field that is not a sum.
  [[nodiscard]] double magnitude() const { return vectors_.front().norm(); }

  /// @return the field at level 1, averaged over the run. For a sum, it is at(1). For a single
  ///         field, it has the mean direction of the tilts' vectors and the length magnitude().
  [[nodiscard]] Eigen::Vector3d mean() const;

  /// @return the name of a vector for messages: "the field", "the field geomagnetic", "the field in
  ///         block 2".
  [[nodiscard]] std::string name_of(std::size_t which) const;

  /// @return the factor by which a level multiplies a part.
  [[nodiscard]] double factor_of(std::size_t part, const FieldLevel& level) const {
    return parts()[part].set_by_level ? level.of(parts()[part].level_name()) : 1.0;
  }

  /// @return true if the field is zero at this level, e.g. because the lamp is off.
  [[nodiscard]] bool is_dark(const FieldLevel& level) const;

  /// @return the field of a reading at a level, frame table [unit of the field].
  [[nodiscard]] Eigen::Vector3d at(const FieldLevel& level, std::size_t tilt = 0) const;

  /// @return the derivative of at() with respect to one of the vectors, 3 x 3.
  [[nodiscard]] Eigen::Matrix3d change(const FieldLevel& level,
                                       std::size_t tilt,
                                       std::size_t which) const;

  /// @return the derivative of mean() with respect to one of the vectors, 3 x 3.
  [[nodiscard]] Eigen::Matrix3d change_of_mean(std::size_t which) const;

  /// @return for each vector, the directions in which a fit changes it, as columns. The directions
  ///         are two unit vectors perpendicular to the vector, or the three axes if the magnitude
  ///         of the vector is unknown.
  [[nodiscard]] std::vector<Tangents> tangents() const;

  /// @return the change of a vector for a step of 1 along a tangent [unit of the field]. It is the
  ///         vector's length. If the vector's magnitude is unknown, it is the length of the longest
  ///         vector of known magnitude.
  [[nodiscard]] double step_unit(std::size_t which) const;

  /// @return the field after a step of a fit. A vector of known magnitude is rotated by two angles
  ///         [rad]. A vector of unknown magnitude is changed by the step times step_unit().
  /// @param tangents  the result of tangents().
  /// @param step      one entry for each column of `tangents`, in the same order.
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

  // Returns the index of the part that is the table's rotation, or parts().size() if the table does
  // not turn at this level.
  [[nodiscard]] std::size_t turning_part(const FieldLevel& level) const;

  std::shared_ptr<const Layout> layout_;
  std::vector<Eigen::Vector3d> vectors_;
};

}  // namespace axiscal
