// SPDX-License-Identifier: Apache-2.0
#include "calib/record/parameter_names.hpp"

#include <cmath>
#include <string_view>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/calib/uncertainty.hpp"

namespace axiscal {

namespace {

void append_name(const std::string& axis,
                 Eigen::Index column,
                 const std::vector<std::string>& also_kinds,
                 std::vector<std::string>& names) {
  std::string& name = names.emplace_back(axis);
  if (column == 0) {
    name += ".bias";
    return;
  }
  const auto component = static_cast<std::size_t>(column - 1);
  name += '.';
  name += component < 3 ? "sensitivity" : std::string_view(also_kinds[component / 3 - 1]);
  name += '.';
  name += "xyz"[component % 3];
}

}  // namespace

std::vector<std::string> names_of_columns(const std::vector<std::string>& axes,
                                          const std::vector<Eigen::Index>& columns,
                                          const std::vector<std::string>& also_kinds) {
  std::vector<std::string> names;
  names.reserve(axes.size() * columns.size());
  for (const std::string& axis : axes) {
    for (const Eigen::Index column : columns) {
      append_name(axis, column, also_kinds, names);
    }
  }
  return names;
}

std::string power_suffix(int power) {
  return ".d" + (power > 1 ? std::to_string(power) : "");
}

std::vector<std::string> temperature_suffixes(int order) {
  std::vector<std::string> suffixes;
  for (const char* const what : {".bias", ".scale"}) {
    for (int j = 1; j <= order; ++j) {
      suffixes.push_back(what + power_suffix(j));
    }
  }
  return suffixes;
}

std::vector<std::string> parameter_names(const std::vector<std::string>& axes,
                                         const std::vector<std::string>& also_kinds,
                                         int temperature_order) {
  const auto columns = static_cast<Eigen::Index>(4 + 3 * also_kinds.size());
  const std::vector<std::string> suffixes = temperature_suffixes(temperature_order);
  std::vector<std::string> names;
  names.reserve(axes.size() * (static_cast<std::size_t>(columns) + suffixes.size()));
  for (const std::string& axis : axes) {
    for (Eigen::Index column = 0; column < columns; ++column) {
      append_name(axis, column, also_kinds, names);
    }
    for (const std::string& suffix : suffixes) {
      names.push_back(axis + suffix);
    }
  }
  return names;
}

void fill_intervals(FitStatistics& statistics) {
  const Eigen::Index count = statistics.covariance.rows();
  if (statistics.interval_dof.size() == count) {
    return;
  }
  const Eigen::Index m = statistics.degrees_of_freedom.size();
  const Eigen::Index p = m > 0 ? count / m : 0;
  statistics.interval_dof.resize(count);
  for (Eigen::Index k = 0; k < m; ++k) {
    statistics.interval_dof.segment(p * k, p).setConstant(statistics.degrees_of_freedom(k));
  }
  put_intervals(statistics);
}

void put_intervals(FitStatistics& statistics) {
  const Eigen::Index count = statistics.covariance.rows();
  statistics.interval_95.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    statistics.interval_95(i) =
        student_t_factor(0.95, statistics.interval_dof(i)) * std::sqrt(statistics.covariance(i, i));
  }
}

void add_component(ScatterComponent component, FitStatistics& statistics) {
  fill_intervals(statistics);
  for (Eigen::Index i = 0; i < statistics.covariance.rows(); ++i) {
    if (component.covariance(i, i) > 0.0) {
      VarianceShares shares;
      shares.axes.push_back({.variance = statistics.covariance(i, i),
                             .degrees_of_freedom = statistics.interval_dof(i)});
      shares.components.push_back({.variance = component.covariance(i, i),
                                   .degrees_of_freedom = component.degrees_of_freedom});
      const CombinedUncertainty combined = combine(shares);
      statistics.interval_dof(i) = combined.degrees_of_freedom;
      statistics.interval_95(i) = combined.expanded;
    }
  }
  statistics.covariance += component.covariance;
  statistics.components.push_back(std::move(component));
}

void add_intervals(Calibration& calibration) {
  FitStatistics& statistics = *calibration.fit.statistics;
  const Eigen::Index m = calibration.sensor.response.bias.size();
  std::vector<std::string> also_kinds;
  for (const AlsoResponse& also : calibration.sensor.also) {
    also_kinds.push_back(also.kind);
  }
  const int order = calibration.sensor.temperature
                        ? static_cast<int>(calibration.sensor.temperature->bias.cols())
                        : 0;
  statistics.parameter_names =
      parameter_names(calibration.sensor.instrument.axes, also_kinds, order);
  const auto base = static_cast<Eigen::Index>(4 + 3 * also_kinds.size());
  const Eigen::Index p = base + 2 * order;
  statistics.bias_se.resize(m);
  statistics.sensitivity_se.resize(m, 3);
  statistics.coverage_factor.resize(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Eigen::VectorXd se = statistics.covariance.diagonal().segment(p * k, p).cwiseSqrt();
    statistics.bias_se(k) = se(0);
    statistics.sensitivity_se.row(k) = se.segment<3>(1);
    for (std::size_t a = 0; a < calibration.sensor.also.size(); ++a) {
      calibration.sensor.also[a].sensitivity_se.row(k) =
          se.segment<3>(4 + 3 * static_cast<Eigen::Index>(a));
    }
    if (order > 0) {
      calibration.sensor.temperature->bias_se.row(k) = se.segment(base, order);
      calibration.sensor.temperature->scale_se.row(k) = se.tail(order);
    }
    statistics.coverage_factor(k) = student_t_factor(0.95, statistics.degrees_of_freedom(k));
  }
  fill_intervals(statistics);
}

}  // namespace axiscal
