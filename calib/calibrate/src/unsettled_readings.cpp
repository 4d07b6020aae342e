// SPDX-License-Identifier: Apache-2.0
#include "calib/calibrate/src/unsettled_readings.hpp"

#include "axiscal/core/number_text.hpp"
#include "calib/regression/settling.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the layings with at least fewest_of_series readings. A laying is a series of consecutive
// readings in one pose, after the cube was laid down.
std::vector<ReadingSeries> long_layings(const std::vector<Reading>& readings,
                                        const std::vector<std::size_t>& rows) {
  const auto continues = [](const Reading& before, const Reading& now) {
    return in_one_pose(before, now) && before.block == now.block && before.confirm == now.confirm;
  };
  std::vector<ReadingSeries> layings;
  for (std::size_t i = 0; i < rows.size();) {
    std::size_t end = i + 1;
    while (end < rows.size() && continues(readings[rows[i]], readings[rows[end]])) {
      ++end;
    }
    if (end - i >= static_cast<std::size_t>(fewest_of_series)) {
      layings.push_back(
          {.first = static_cast<Eigen::Index>(i), .readings = static_cast<Eigen::Index>(end - i)});
    }
    i = end;
  }
  return layings;
}

}  // namespace

std::optional<UnsettledReadings> find_unsettled(const PreparedRun& run) {
  const Observations& observations = run.observations();
  const std::vector<Reading>& readings = observations.readings;
  if (readings.size() < fewest_series * static_cast<std::size_t>(fewest_of_series) ||
      !readings.front().point) {
    return std::nullopt;
  }
  const std::vector<std::size_t> rows = run.rows_not_left_out();
  const std::vector<ReadingSeries> layings = long_layings(readings, rows);
  if (layings.size() < fewest_series) {
    return std::nullopt;
  }
  const UnsettledStart start =
      find_unsettled_start(observations.response(rows, Eigen::all), layings);
  if (start.readings == 0) {
    return std::nullopt;
  }
  UnsettledReadings found;
  for (const ReadingSeries& laying : layings) {
    for (Eigen::Index i = 0; i < start.readings; ++i) {
      const std::size_t row = rows[static_cast<std::size_t>(laying.first + i)];
      found.rows.push_back(row);
      found.warning.runs.push_back(readings[row].run);
    }
  }
  found.warning.code = WarningCode::unsettled;
  found.warning.message = formatted(
      "The instrument had not settled: in each pose, the first {} from the later readings, by up "
      "to {}. {} left out. Wait longer before the first reading",
      start.readings == 1 ? std::string("reading differs")
                          : formatted("{} readings differ", start.readings),
      number_text(start.largest, 2), start.readings == 1 ? "It was" : "They were");
  return found;
}

}  // namespace axiscal
