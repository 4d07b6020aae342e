// SPDX-License-Identifier: Apache-2.0
#include "adjuster_options.hpp"

#include <algorithm>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {

void set_adjusters(const std::optional<std::string>& adjusters,
                   const std::optional<std::string>& thread_pitch,
                   Surface& surface) {
  if (adjusters) {
    surface.adjusters_m.clear();
    for (const std::string_view pair : split(*adjusters, ';')) {
      if (std::count(pair.begin(), pair.end(), ',') != 1) {
        throw UsageError(
            formatted("--adjusters: '{}' must be the positions of the adjusters in "
                      "metres, in the form \"X,Y;X,Y;X,Y\"",
                      *adjusters));
      }
      const std::vector<double> xy = numbers_of("--adjusters", std::string(pair), 2);
      surface.adjusters_m.emplace_back(xy[0], xy[1]);
    }
  }
  if (thread_pitch) {
    surface.thread_pitch_m = number_of("--thread-pitch", *thread_pitch);
  }
  if (surface.adjusters_m.empty()) {
    throw UsageError(
        "the positions of the table's height adjusters are missing: give --adjusters "
        "\"X,Y;X,Y;X,Y\" in metres, or --positioner FILE with these positions");
  }
  try {
    const Eigen::Vector2d none = Eigen::Vector2d::Zero();
    static_cast<void>(level_table(none, Eigen::Matrix2d::Zero(), surface));
  } catch (const DomainError& error) {
    throw UsageError("--adjusters", error);
  }
}

}  // namespace axiscal::cli
