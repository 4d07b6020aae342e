// SPDX-License-Identifier: Apache-2.0
#include "logs/src/unsettled_rests.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/regression/settling.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t parts = 8;
constexpr std::size_t fewest_samples = 3 * parts;

// Returns the index of the first sample of part `part` of a rest. Part 8 begins at the rest's end.
std::size_t begin_of(const StaticInterval& rest, std::size_t part) {
  return rest.first + part * rest.samples() / parts;
}

double mean_of(const std::vector<double>& column, std::size_t first, std::size_t end) {
  const auto from = column.begin() + static_cast<std::ptrdiff_t>(first);
  return std::accumulate(from, column.begin() + static_cast<std::ptrdiff_t>(end), 0.0) /
         static_cast<double>(end - first);
}

}  // namespace

UnsettledRests find_unsettled_rests(const std::vector<StaticInterval>& rests,
                                    const std::vector<const std::vector<double>*>& columns) {
  std::vector<const StaticInterval*> compared;
  for (const StaticInterval& rest : rests) {
    if (rest.samples() >= fewest_samples) {
      compared.push_back(&rest);
    }
  }
  if (compared.size() < fewest_series) {
    return {};
  }
  constexpr auto of_rest = static_cast<Eigen::Index>(parts);
  Eigen::MatrixXd means(of_rest * std::ssize(compared), std::ssize(columns));
  std::vector<ReadingSeries> series;
  for (const StaticInterval* const rest : compared) {
    const Eigen::Index first = of_rest * std::ssize(series);
    series.push_back({.first = first, .readings = of_rest});
    for (std::size_t part = 0; part < parts; ++part) {
      for (std::size_t c = 0; c < columns.size(); ++c) {
        means(first + static_cast<Eigen::Index>(part), static_cast<Eigen::Index>(c)) =
            mean_of(*columns[c], begin_of(*rest, part), begin_of(*rest, part + 1));
      }
    }
  }
  const UnsettledStart start = find_unsettled_start(means, series);
  UnsettledRests found{.spans = {},
                       .fraction = static_cast<double>(start.readings) / static_cast<double>(parts),
                       .largest = start.largest,
                       .settles = start.settles};
  for (const StaticInterval* const rest : compared) {
    if (start.readings > 0) {
      found.spans.emplace_back(rest->first,
                               begin_of(*rest, static_cast<std::size_t>(start.readings)));
    }
  }
  return found;
}

std::optional<Segmentation> settled_rests(LogFile& log,
                                          SegmentOptions options,
                                          const Segmentation& rests,
                                          const UnsettledRests& unsettled) {
  options.left_out.insert(options.left_out.end(), unsettled.spans.begin(), unsettled.spans.end());
  std::sort(options.left_out.begin(), options.left_out.end());
  options.threshold = rests.threshold;
  options.shortest_s *= 1.0 - unsettled.fraction;
  try {
    Segmentation settled = segment(log, options);
    if (settled.intervals.size() == rests.intervals.size()) {
      return settled;
    }
  } catch (const RefusedError&) {
    // no rest remains
  }
  return std::nullopt;
}

std::string sentence_about(const UnsettledRests& unsettled, bool left_out) {
  std::string text = formatted(
      "the readings had not settled at the start of the rests: they differ from the later ones by "
      "up to {}. ",
      number_text(unsettled.largest, 2));
  text += left_out ? formatted("The first {} % of each rest are left out",
                               number_text(100.0 * unsettled.fraction, 2))
                   : std::string("The rests are too short to leave these readings out");
  return text + (unsettled.settles ? ". Wait longer in each position"
                                   : ". The readings still change afterwards, so the biases may be "
                                     "wrong: wait longer in each position");
}

}  // namespace axiscal
