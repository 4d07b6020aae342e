// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/fit/magnitude.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/common_mean.hpp"
#include "calib/regression/jackknife.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the set with only the given rows.
ReadingSet part_of(const ReadingSet& set, const std::vector<Eigen::Index>& rows) {
  ReadingSet part = set;
  part.readings.clear();
  part.rotation_sensor_from_table.clear();
  part.field_then.clear();
  for (const Eigen::Index i : rows) {
    const auto at = static_cast<std::size_t>(i);
    part.readings.push_back(set.readings[at]);
    if (!set.rotation_sensor_from_table.empty()) {
      part.rotation_sensor_from_table.push_back(set.rotation_sensor_from_table[at]);
    }
    if (!set.field_then.empty()) {
      part.field_then.push_back(set.field_then[at]);
    }
  }
  part.response = set.response(rows, Eigen::all);
  part.weights = set.weights(rows, Eigen::all);
  part.effects.columns = Eigen::MatrixXd(static_cast<Eigen::Index>(rows.size()), 0);
  return part;
}

}  // namespace

Estimate estimate_sessions(const ReadingSet& set,
                           double F,
                           MagnitudeShape shape,
                           const Eigen::Matrix3d& noise,
                           bool squares) {
  std::map<int, std::vector<Eigen::Index>> rows;
  for (Eigen::Index i = 0; i < set.size(); ++i) {
    rows[set.readings[static_cast<std::size_t>(i)].block].push_back(i);
  }
  Estimate all = estimate_magnitude(set, F, shape, noise, squares);
  const auto is_session = [](const auto& one) {
    constexpr std::size_t fewest = 20;
    return one.second.size() >= fewest;
  };
  const bool are_sessions = rows.size() > 1 && std::all_of(rows.begin(), rows.end(), is_session);
  if (!are_sessions || set.robust) {
    return all;
  }
  std::vector<Estimate> sessions;
  try {
    for (const auto& [block, own] : rows) {
      sessions.push_back(estimate_magnitude(part_of(set, own), F, shape, noise, squares));
    }
  } catch (const RefusedError& error) {
    all.notes.push_back(
        {NoteCode::conditions,
         formatted("the sessions were fitted together, because one of them does not determine the "
                   "coefficients ({}). The intervals do not include differences between sessions",
                   error.what())});
    return all;
  }
  const auto B = static_cast<Eigen::Index>(sessions.size());
  FitStatistics& statistics = all.statistics;
  fill_intervals(statistics);
  const Eigen::Index m = set.axis_count();
  Eigen::VectorXd u(4 * m);
  Eigen::VectorXd intervals(4 * m);
  ScatterComponent between{.name = "sessions",
                           .sd = Eigen::VectorXd::Zero(m),
                           .unit = {},
                           .covariance = {},
                           .degrees_of_freedom = static_cast<double>(B - 1)};
  Eigen::VectorXd squares_of_session = Eigen::VectorXd::Zero(m);
  double free = 0.0;
  for (Estimate& session : sessions) {
    fill_intervals(session.statistics);
    squares_of_session +=
        session.statistics.degrees_of_freedom(0) * session.statistics.residual_sd.cwiseAbs2();
    free += session.statistics.degrees_of_freedom(0);
  }
  for (Eigen::Index at = 0; at < 4 * m; ++at) {
    const Eigen::Index k = at / 4;
    const Eigen::Index j = at % 4;
    Eigen::VectorXd x(B);
    Eigen::VectorXd own(B);
    for (Eigen::Index s = 0; s < B; ++s) {
      const Estimate& session = sessions[static_cast<std::size_t>(s)];
      x(s) = j == 0 ? session.response.bias(k) : session.response.sensitivity(k, j - 1);
      // The standard deviation of the normal distribution that has the same 95 % interval.
      own(s) = std::max(session.statistics.interval_95(at) / normal_quantile(0.975), 1e-300);
    }
    const CommonMean mean = common_mean(x, own);
    (j == 0 ? all.response.bias(k) : all.response.sensitivity(k, j - 1)) = mean.mean;
    u(at) = std::max(mean.u, mean.u_within);
    intervals(at) = std::max(student_t_factor(0.95, static_cast<double>(B - 1)) * mean.u,
                             normal_quantile(0.975) * mean.u_within);
    if (j == 0) {
      between.sd(k) = mean.between;
    }
  }
  statistics.residual_sd = (squares_of_session / free).cwiseSqrt();
  statistics.degrees_of_freedom.setConstant(free);
  statistics.covariance = rescaled_covariance(statistics.covariance, u);
  statistics.components.clear();
  between.covariance = statistics.covariance;
  for (Eigen::Index at = 0; at < 4 * m; ++at) {
    if (u(at) > 0.0) {
      statistics.interval_dof(at) = freedom_of_factor(intervals(at) / u(at), 0.95);
    }
  }
  statistics.interval_95 = intervals;
  statistics.components.push_back(std::move(between));
  std::erase_if(all.notes, [](const CalibrationNote& note) {
    return note.code == NoteCode::correlation || note.code == NoteCode::estimate_bias;
  });
  all.blocks.sessions = static_cast<int>(B);
  all.notes.push_back(
      {NoteCode::conditions,
       formatted("{} sessions were fitted separately; the coefficients are their means, and the "
                 "intervals include the differences between sessions{}",
                 B,
                 B == 2 ? "; two sessions determine these differences only roughly: take four "
                          "sessions"
                        : "")});
  return all;
}

}  // namespace axiscal
