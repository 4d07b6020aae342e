// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <utility>

#include "axiscal/core/rotation.hpp"
#include "calib/mistakes/src/mistake_kind.hpp"

namespace axiscal {
namespace {

constexpr std::array tilted_seat_advice = {MistakeAdvice{
    .code = WarningCode::tilted_seat,
    .one = "Look for grit under a foot or a gap between cube and fence, and take the reading "
           "again."}};

// Returns the fit with a rotation of the field's direction in reading i only.
HypothesisFit fit_tilted(const SuspectRun& run, std::size_t i) {
  const auto row = static_cast<Eigen::Index>(i);
  if (run.set().field.is_dark(run.set().readings[i].level)) {
    return {};  // without a field a tilt has no effect
  }
  return run.fitter().fit(
      run.set(), {},
      [&, i, row](const TableField& field, const Eigen::MatrixXd& c) -> Eigen::MatrixXd {
        const Eigen::Matrix3d& rotation = run.set().rotation_sensor_from_table[i];
        const Eigen::Vector3d met = rotation * run.set().field_in_table(row, field);
        const Eigen::Vector3d start = rotation * run.set().field_in_table(row, run.plain().field);
        Eigen::MatrixXd Z = Eigen::MatrixXd::Zero(run.n() * run.m(), 2);
        const Eigen::Matrix<double, 3, 2> change = met.norm() * tangents_of(start);
        for (Eigen::Index k = 0; k < run.m(); ++k) {
          Z.row(run.n() * k + row) = c.col(k).segment<3>(1).transpose() * change;
        }
        return Z;
      });
}

// Fits a tilt to each of the worst readings if the run has few readings. If the run has many
// readings, deletion_p() tests each reading against the others, and no tilt is fitted.
void detect_tilt(const SuspectRun& run, const Consider& consider) {
  constexpr std::size_t most_tried = 3;
  if (!run.has_independent_readings()) {
    for (const std::size_t i : first_of(run.ranked_by_deletion(), most_tried)) {
      consider(fit_tilted(run, i), {.tests = static_cast<double>(run.n()), .of_few = true});
    }
  }
}

void explain_by_tilt(const SuspectRun& run, std::size_t i, Explanations& found) {
  Correction correction = about(run, WarningCode::tilted_seat, {i});
  correction.leave_out = correction.runs;
  found.add(fit_tilted(run, i), {angle_range_rad, angle_range_rad}, static_cast<double>(run.n()),
            std::move(correction), "with its seat tilted");
}

}  // namespace

MistakeKind tilted_seat_kind() {
  return {.advice = tilted_seat_advice, .of_reading = explain_by_tilt, .detect = detect_tilt};
}

}  // namespace axiscal
