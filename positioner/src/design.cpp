// SPDX-License-Identifier: Apache-2.0
#include "axiscal/positioner/design.hpp"

#include <algorithm>
#include <span>
#include <string>

#include "axiscal/core/error.hpp"
#include "axiscal/core/random.hpp"
#include "core/formatted.hpp"

namespace axiscal {

std::vector<DesignEntry> standard_design(int points) {
  if (points != 6 && points != 12 && points != 24) {
    throw DomainError(
        formatted("standard_design: the designs have 6, 12 or 24 points, not {}", points));
  }
  std::vector<DesignEntry> design;
  design.reserve(static_cast<std::size_t>(points));
  for (const int step : {1, 2}) {
    for (const Face rest : all_faces) {
      const int fence_axis = (axis_of(rest) + step) % 3;
      design.push_back({.point = {rest, face_of(fence_axis, true)}});
      if (points > 6) {
        design.push_back({.point = {rest, face_of(fence_axis, false)}});
      }
    }
    if (points < 24) {
      break;
    }
  }
  return design;
}

std::vector<RunSheetRow> make_run_sheet(const std::vector<DesignEntry>& design,
                                        int replicates,
                                        std::uint64_t seed,
                                        const std::vector<double>& temperatures) {
  RandomStream random(seed);
  return make_run_sheet(design, replicates, random, temperatures);
}

std::vector<RunSheetRow> make_run_sheet(const std::vector<DesignEntry>& design,
                                        int replicates,
                                        RandomStream& random,
                                        const std::vector<double>& temperatures) {
  if (design.empty() || replicates < 1) {
    throw DomainError("make_run_sheet: at least one design point and one replicate are needed");
  }
  std::vector<RunSheetRow> sheet;
  const int soaks = std::max(1, static_cast<int>(temperatures.size()));
  sheet.reserve(design.size() * static_cast<std::size_t>(soaks * replicates));
  for (int block = 1; block <= soaks * replicates; ++block) {
    std::vector<DesignEntry> order = design;
    random.shuffle(std::span(order));
    for (const DesignEntry& entry : order) {
      RunSheetRow row{.run = static_cast<int>(sheet.size()) + 1, .block = block, .entry = entry};
      if (!temperatures.empty()) {
        row.temperature = temperatures[static_cast<std::size_t>((block - 1) / replicates)];
      }
      sheet.push_back(row);
    }
  }
  return sheet;
}

}  // namespace axiscal
