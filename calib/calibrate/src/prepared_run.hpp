// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_source.hpp"

namespace axiscal {

/// @return true if both readings have the same design point, level and stated field.
[[nodiscard]] bool in_one_pose(const Reading& a, const Reading& b);

/// A run that has passed its checks and can be fitted: the readings to use, their weights, the
/// method, and the field before the fit.
class PreparedRun {
 public:
  /// @param experiment, observations  must outlive the run.
  /// @throws SetupError, RefusedError, DomainError  if experiment and observations contradict each
  ///                                                other, or do not suit the method.
  PreparedRun(const Experiment& experiment, const Observations& observations);

  PreparedRun(const PreparedRun&) = delete;
  PreparedRun& operator=(const PreparedRun&) = delete;

  [[nodiscard]] const Experiment& experiment() const { return experiment_; }

  /// @return all observations. Stated attitudes are converted to fields.
  [[nodiscard]] const Observations& observations() const {
    return with_fields_ ? *with_fields_ : given_;
  }

  /// @return the observations of the fit, without the readings that are left out or used only to
  ///         confirm the fit. Only the members `readings` and `has_fence` are valid.
  [[nodiscard]] const Observations& used() const { return used_ ? *used_ : observations(); }

  /// @return the rows of observations() that Experiment::leave_out does not exclude.
  [[nodiscard]] std::vector<std::size_t> rows_not_left_out() const;

  [[nodiscard]] const MethodKind& method() const { return method_kind(method_); }
  [[nodiscard]] Weighting weighting() const { return weighting_; }

  /// @return true if each reading has its own stated field.
  [[nodiscard]] bool by_field() const { return source_.by_field(); }

  /// @return true if the magnitudes of the fields stated with the readings differ, as on a rate
  ///         table.
  [[nodiscard]] bool field_varies() const { return field_varies_; }

  /// @return the readings and the simplest model of them, which has no temperature terms and no
  ///         effects of the run.
  [[nodiscard]] const ReadingSource& source() const { return source_; }

  /// @return the parts of the field as stated, before the fit.
  [[nodiscard]] const std::vector<FieldDescription>& parts() const { return parts_; }

  /// @return a record with what is known before the fit: instrument, field, method, weights, and
  ///         notes on these.
  [[nodiscard]] Calibration described() const;

 private:
  const Experiment& experiment_;
  const Observations& given_;
  std::optional<Observations> with_fields_;
  std::optional<Observations> used_;
  Method method_;
  Weighting weighting_;
  ReadingSource source_;
  std::vector<FieldDescription> parts_;
  bool field_varies_ = false;
  std::vector<CalibrationNote> notes_;
};

}  // namespace axiscal
