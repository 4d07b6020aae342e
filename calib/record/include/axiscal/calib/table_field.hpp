// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace axiscal {

/// One part of a field that is a sum, as the Earth's rotation and a turntable's.
struct FieldPartDescription {
  std::string kind;
  double magnitude = 1.0;    ///< at level 1 [unit of the whole]; fitted where it was not known
  double magnitude_u = 0.0;  ///< its standard uncertainty [unit of the whole]; 0: not stated
  Eigen::Vector3d in_table = Eigen::Vector3d::Zero();  ///< at level 1 [unit of the whole]
  bool set_by_level = true;                            ///< a reading's level multiplies it: induced
  bool turning = false;      ///< the table turns about it: of the other parts what lies along its
                             ///< axis is left on average, except at level 0
  bool free_length = false;  ///< its magnitude is not known and is fitted
};

/// How the field lies in the table, its vectors left open: which parts add up, what a reading's
/// level multiplies, how often the table was tilted anew. All that is fitted of a field, and all
/// that is said of one, goes through here.
///
/// The vectors are, frame table [unit of the field], of a sum those of its parts at level 1; else
/// one for each tilt. A sum has one tilt.
class TableField {
 public:
  using Vectors = std::vector<Eigen::Vector3d>;
  using Tangents = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  /// One field that the level multiplies, on a table that stays as it is.
  TableField() = default;

  /// @param parts  one or more. A single one is multiplied by the level, which is 1 where it cannot
  ///               be set.
  explicit TableField(std::vector<FieldPartDescription> parts);

  /// From now on each block has its own tilt.
  /// @param blocks  their numbers, ascending, one or more.
  void tilt_by_block(std::vector<int> blocks) { blocks_ = std::move(blocks); }

  [[nodiscard]] bool is_sum() const { return parts_.size() > 1; }
  [[nodiscard]] const std::vector<FieldPartDescription>& parts() const { return parts_; }

  /// @return whether a part turns, so that the sum is not linear in the others.
  [[nodiscard]] bool turns() const;

  /// @return whether some part is made on the table, so that other levels can be asked for.
  [[nodiscard]] bool level_can_be_set() const { return level_can_be_set_; }

  /// @return the block that each tilt is of.
  [[nodiscard]] const std::vector<int>& blocks() const { return blocks_; }

  /// @return the tilt of a block; 0 for one that has none of its own.
  [[nodiscard]] std::size_t tilt_of_block(int block) const;

  /// @return how many vectors there are.
  [[nodiscard]] std::size_t vector_count() const {
    return is_sum() ? parts_.size() : blocks_.size();
  }

  /// @return "the field", "the field geomagnetic", "the field in block 2".
  [[nodiscard]] std::string name_of(std::size_t which) const;

  /// @return what a reading at a level meets, frame table.
  [[nodiscard]] Eigen::Vector3d at(const Vectors& vectors,
                                   double level,
                                   std::size_t tilt = 0) const;

  /// @return what that changes with one of the vectors, 3 x 3.
  [[nodiscard]] Eigen::Matrix3d change(const Vectors& vectors,
                                       double level,
                                       std::size_t tilt,
                                       std::size_t which) const;

  /// @return what the mean of the tilts, or a sum at level 1, changes with one of the vectors.
  [[nodiscard]] Eigen::Matrix3d change_of_mean(const Vectors& vectors, std::size_t which) const;

  /// The directions in which a vector is open, of length 1: two across it, and one along it where
  /// its magnitude is not known.
  [[nodiscard]] Tangents tangents(const Vectors& vectors, std::size_t which) const;

  /// A vector after a step: turned by the two angles across it [rad], lengthened by e to the third.
  /// @param tangents  of the vector, as above.
  [[nodiscard]] static Eigen::Vector3d moved(const Eigen::Vector3d& vector,
                                             const Tangents& tangents,
                                             const Eigen::VectorXd& step);

 private:
  // How much of a part a level leaves.
  [[nodiscard]] double factor_of(std::size_t part, double level) const {
    return parts_[part].set_by_level ? level : 1.0;
  }
  // The part that the table turns about at a level; parts_.size() where none does.
  [[nodiscard]] std::size_t turning_part(double level) const;

  std::vector<FieldPartDescription> parts_ = std::vector<FieldPartDescription>(1);
  bool level_can_be_set_ = true;
  std::vector<int> blocks_ = {1};
};

}  // namespace axiscal
