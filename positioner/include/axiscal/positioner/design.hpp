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

/// The standard designs.
///
/// 12: each rest face of axis a with the two fence faces of the next axis in the cycle X, Y, Z, X;
/// then [1, vec R_i] has orthogonal columns for every direction of the field. 24: every point.
/// 6: each rest face with one fence face; enough only on a table known to be level.
///
/// @param points  6, 12 or 24.
/// @throws DomainError  for another number.
/// @par Source
/// method.md, section 2; US 7,467,536.
[[nodiscard]] AXISCAL_EXPORT std::vector<DesignEntry> standard_design(int points);

/// One line of a run sheet.
struct RunSheetRow {
  int run = 1;    ///< number of the reading, in the order in which it is to be taken
  int block = 1;  ///< replicate of the whole design, from 1
  DesignEntry entry;
  std::optional<double> temperature;  ///< soak temperature before the block, if one is planned
};

/// Puts a design into random order, block by block; of several temperatures one after another.
///
/// @param design      the points; any list.
/// @param replicates  how often the whole design is taken, at least 1.
/// @param seed        the same seed gives the same order on every machine.
/// @param temperatures  to be soaked at, in this order, with all replicates at each.
/// @throws DomainError  if the design is empty or `replicates` is less than 1.
[[nodiscard]] AXISCAL_EXPORT std::vector<RunSheetRow> make_run_sheet(
    const std::vector<DesignEntry>& design,
    int replicates,
    std::uint64_t seed,
    const std::vector<double>& temperatures = {});

/// As above, with a stream. RandomStream(seed) gives the order of that seed.
[[nodiscard]] AXISCAL_EXPORT std::vector<RunSheetRow> make_run_sheet(
    const std::vector<DesignEntry>& design,
    int replicates,
    RandomStream& random,
    const std::vector<double>& temperatures);

}  // namespace axiscal
