// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace axiscal {

/// The conversion f = A (v - b) of readings v of three axes to the field f.
struct ColumnReduction {
  std::array<double, 3> bias{};     ///< bias b [unit of the readings]
  std::array<double, 9> inverse{};  ///< matrix A, row by row [field unit per unit of the readings]
  double magnitude = 1.0;           ///< magnitude F [field unit], used only for the pitch
};

/// Three columns, x y z, of equal length.
using ReadColumns = std::array<std::span<const double>, 3>;
using WrittenColumns = std::array<std::span<double>, 3>;

/// Pitch and roll of each row [rad].
struct AngleColumns {
  std::span<double> pitch_rad;  ///< asin(f_x / F), its argument clamped to -1 .. 1; NaN stays NaN
  std::span<double> roll_rad;   ///< atan2(f_y, f_z)
};

/// Converts readings that are stored as one column for each axis to the field. `field` may be
/// `readings` itself.
void reduce_columns(const ColumnReduction& reduction,
                    const ReadColumns& readings,
                    const WrittenColumns& field);

/// Converts readings to the field, and computes pitch and roll from the field in forward-left-up
/// axes.
void reduce_columns(const ColumnReduction& reduction,
                    const ReadColumns& readings,
                    const WrittenColumns& field,
                    const AngleColumns& angles);

/// Converts readings that are stored in rows of three (x y z x y z ...) to the field. `field` may
/// be `readings` itself.
void reduce_rows(const ColumnReduction& reduction,
                 std::span<const double> readings,
                 std::span<double> field);

/// Plain versions (without vector instructions), as references for tests.
void reduce_columns_plain(const ColumnReduction& reduction,
                          const ReadColumns& readings,
                          const WrittenColumns& field);
void add_angles_plain(const ColumnReduction& reduction,
                      const ReadColumns& field,
                      const AngleColumns& angles);

}  // namespace axiscal
