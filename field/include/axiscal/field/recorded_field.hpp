// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"
#include "axiscal/field/reference_field.hpp"

namespace axiscal {

/// A field that another instrument, at a fixed place, recorded while the readings were taken. The
/// record contains the field's vector in the table at several times. Between the times the field is
/// interpolated linearly.
class AXISCAL_EXPORT RecordedField final : public ReferenceField {
 public:
  /// @param of         the field that was recorded; its kind, unit and role are used.
  /// @param times_s    two or more ascending times [s], by the same clock as the readings' times.
  /// @param in_table   3 x n [unit of the field], frame table; no vector is zero.
  /// @param path       path of the file that contains the record, or empty. The path is written to
  ///                   the experiment's file.
  /// @throws DomainError  if `times_s` or `in_table` does not satisfy these conditions.
  RecordedField(std::shared_ptr<const ReferenceField> of,
                std::vector<double> times_s,
                Eigen::Matrix3Xd in_table,
                std::string path = "");

  /// @return the mean vector [unit()], frame table.
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override;
  [[nodiscard]] std::string_view unit() const override { return of_->unit(); }
  [[nodiscard]] std::string_view kind() const override { return of_->kind(); }
  [[nodiscard]] bool is_induced() const override { return of_->is_induced(); }
  [[nodiscard]] bool moves() const override { return true; }
  [[nodiscard]] bool needs_utc() const override { return false; }

  /// @throws RefusedError  if the time is outside the record.
  [[nodiscard]] Eigen::Vector3d value_in_enu_at(double time_s) const override;
  [[nodiscard]] Eigen::Vector3d moving_in_table(const TablePlace& place,
                                                double time_s) const override;
  void resolve(FieldResolver& of) const override;
  void members(JsonMembers& io) override;

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::shared_ptr<const ReferenceField> of_;
  std::vector<double> times_s_;
  Eigen::Matrix3Xd in_table_;
  std::string path_;
};

/// Reads a field's record: CSV with a column `time` (seconds, or ISO 8601) and three more columns,
/// the components along the table's x, y and z.
///
/// @param of    the field that was recorded; its kind, unit and role are used.
/// @throws DataError  if the columns are different, the times do not ascend, or a vector is zero.
[[nodiscard]] AXISCAL_EXPORT RecordedField
read_recorded_field(const std::string& path, std::shared_ptr<const ReferenceField> of);

}  // namespace axiscal
