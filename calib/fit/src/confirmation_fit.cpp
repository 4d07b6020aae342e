// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/confirmation_fit.hpp"

#include <cmath>
#include <numeric>

#include "axiscal/calib/distributions.hpp"
#include "axiscal/core/error.hpp"
#include "calib/fit/deletion_fit.hpp"

namespace axiscal {
namespace {

Eigen::MatrixXd below(const Eigen::MatrixXd& above, const Eigen::MatrixXd& more) {
  Eigen::MatrixXd both(above.rows() + more.rows(), above.cols());
  both << above, more;
  return both;
}

template <typename Value>
void append(const std::vector<Value>& more, std::vector<Value>& all) {
  all.insert(all.end(), more.begin(), more.end());
}

// The readings of the fit, and behind them those that were kept out.
ReadingSet both_of(ReadingSet set, const ReadingSet& kept_out) {
  append(kept_out.readings, set.readings);
  for (std::size_t i = 0; i < kept_out.rotation_sensor_from_table.size(); ++i) {
    set.rotation_sensor_from_table.push_back(kept_out.rotation_sensor_from_table[i]);
  }
  append(kept_out.field_then, set.field_then);
  set.response = below(set.response, kept_out.response);
  set.weights = below(set.weights, kept_out.weights);
  set.effects.columns = below(set.effects.columns, kept_out.effects.columns);
  set.effects.memory = below(set.effects.memory, kept_out.effects.memory);
  if (set.temperature.order > 0) {
    set.temperature.d = below(set.temperature.d, kept_out.temperature.d);
    set.temperature.soak.clear();
  }
  return set;
}

}  // namespace

Confirmation confirmed(const ReadingSet& fitted,
                       const ReadingSet& kept_out,
                       const TableField& field,
                       bool known_field) {
  const ReadingSet set = both_of(fitted, kept_out);
  std::vector<std::size_t> places(kept_out.readings.size());
  std::iota(places.begin(), places.end(), fitted.readings.size());
  const DeletionFit fit(set, field, known_field);
  const auto q = static_cast<Eigen::Index>(places.size());
  const std::optional<double> p = fit.p_value(places, Eigen::MatrixXd::Identity(q, q));
  const auto predictions = fit.predictions(places);
  if (!p || !predictions) {
    throw RefusedError(
        "the readings of the fit leave nothing to hold those to be confirmed (confirm) against; "
        "take more of them");
  }
  constexpr double unlikely = 0.05;
  Confirmation confirmation{.readings = {}, .p_value = *p, .passed = *p >= unlikely};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const DeletionFit::Prediction& prediction = (*predictions)[i];
    ConfirmationReading& reading = confirmation.readings.emplace_back(ConfirmationReading{
        .run = kept_out.readings[i].run, .error = prediction.error, .half_width = prediction.sd});
    for (Eigen::Index k = 0; k < reading.error.size(); ++k) {
      reading.half_width(k) *= student_t_factor(0.95, prediction.degrees_of_freedom(k));
      reading.within = reading.within && !(std::abs(reading.error(k)) > reading.half_width(k));
    }
  }
  return confirmation;
}

}  // namespace axiscal
