// SPDX-License-Identifier: Apache-2.0
#include "calib/apply/src/reduced_results.hpp"

#include <cmath>

#include "axiscal/core/not_a_number.hpp"

namespace axiscal {

Eigen::VectorXd results_of(const ReducedReading& reduced, std::size_t derived) {
  Eigen::VectorXd results(fixed_results + static_cast<Eigen::Index>(derived));
  results.head<3>() = reduced.field_in_sensor;
  results(3) = reduced.residual;
  for (std::size_t j = 0; j < derived; ++j) {
    results(fixed_results + static_cast<Eigen::Index>(j)) = reduced.derived.values[j];
  }
  return results;
}

std::size_t derived_count(const Reducer& reducer, bool has_up) {
  const InstrumentKind& kind = reducer.kind();
  const bool derives = kind.derive != nullptr && (has_up || !kind.derives_with_attitude);
  return derives ? kind.derived_names.size() : 0;
}

std::vector<std::string> names_of_results(const Reducer& reducer) {
  std::vector<std::string> names = {"field_x", "field_y", "field_z", "residual"};
  for (std::size_t j = 0; j < derived_count(reducer, false); ++j) {
    names.emplace_back(reducer.kind().derived_names[j]);
  }
  return names;
}

double difference_of_results(double a, double b, bool angle) {
  return angle ? std::remainder(a - b, 360.0) : a - b;
}

// A result is an angle if its name ends in _deg.
bool result_is_angle(const Reducer& reducer, Eigen::Index result) {
  return result >= fixed_results &&
         reducer.kind().derived_names[static_cast<std::size_t>(result - fixed_results)].ends_with(
             "_deg");
}

Eigen::VectorXd slope_of_results(const Reducer& reducer,
                                 const Eigen::VectorXd& below,
                                 const Eigen::VectorXd& at,
                                 const Eigen::VectorXd& above,
                                 double step) {
  Eigen::VectorXd result(at.size());
  for (Eigen::Index r = 0; r < at.size(); ++r) {
    const bool angle = result_is_angle(reducer, r);
    if (std::isnan(at(r))) {
      result(r) = not_a_number;
    } else if (std::isnan(below(r))) {
      result(r) = difference_of_results(above(r), at(r), angle) / step;
    } else if (std::isnan(above(r))) {
      result(r) = difference_of_results(at(r), below(r), angle) / step;
    } else {
      result(r) = (difference_of_results(above(r), at(r), angle) +
                   difference_of_results(at(r), below(r), angle)) /
                  (2.0 * step);
    }
  }
  return result;
}

}  // namespace axiscal
