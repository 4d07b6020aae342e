// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "axiscal/core/export.hpp"
#include "axiscal/field/field_level.hpp"
#include "axiscal/positioner/design_point.hpp"

namespace axiscal {

class RandomStream;

/// One point of an experiment: the orientation of the cube, and the level of an induced field.
struct DesignEntry {
  DesignPoint point;
  FieldLevel level;
};

/// Returns a standard design.
///
/// The design of 24 points contains all design points. The design of 12 points combines each rest
/// face with two fence faces: those of the next axis in the cycle X, Y, Z, X. If R_i is the cube's
/// rotation at point i, the matrix with the rows [1, vec R_i] then has orthogonal columns, for any
/// direction of the field. The design of 6 points combines each rest face with one fence face. This
/// design is sufficient only on a table that is known to be level.
///
/// @param points  6, 12 or 24.
/// @throws DomainError  if `points` is another number.
/// @par Source
/// method.md, section 2; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<DesignEntry> standard_design(int points);

/// One line of a run sheet.
struct RunSheetRow {
  int run = 1;    ///< number of the reading, in the order in which it is to be taken
  int block = 1;  ///< number of the replicate, from 1; each replicate is the whole design
  DesignEntry entry;
  std::optional<double> temperature;  ///< soak temperature of the block, if it is planned
};

/// Puts the points of each block into random order. If there are several temperatures, all blocks
/// of one temperature come before those of the next.
///
/// @param design      the points; at least one.
/// @param replicates  number of blocks at each temperature, at least 1; each block contains the
///                    whole design once.
/// @param seed        the same seed gives the same order on every machine.
/// @param temperatures  soak temperatures in the order in which they are used; may be empty.
/// @throws DomainError  if the design is empty or `replicates` is less than 1.
[[nodiscard]] AXISCAL_EXPORT std::vector<RunSheetRow> make_run_sheet(
    const std::vector<DesignEntry>& design,
    int replicates,
    std::uint64_t seed,
    const std::vector<double>& temperatures = {});

/// Like the function above, but takes its random numbers from a stream. A stream RandomStream(seed)
/// gives the same order as the parameter `seed` of that function.
[[nodiscard]] AXISCAL_EXPORT std::vector<RunSheetRow> make_run_sheet(
    const std::vector<DesignEntry>& design,
    int replicates,
    RandomStream& random,
    const std::vector<double>& temperatures);

}  // namespace axiscal
