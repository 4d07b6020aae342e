// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// Returns true if there are enough readings for a jackknife that leaves out one tenth of the
/// recording at a time.
[[nodiscard]] bool is_long_recording(Eigen::Index readings);

/// Replaces the covariance of a long recording, because its consecutive readings are correlated.
/// The new covariance is a component "correlation" with 9 degrees of freedom. It comes from the
/// jackknife, which leaves out one tenth of the recording at a time. The intervals are computed
/// from it.
///
/// @param uncertainties  standard uncertainties of the parameters, from jackknife_uncertainty(). If
///                       one of them is NaN, only a note is added.
/// @par Source
/// method.md, section 4.
void add_long_correlation(const Eigen::VectorXd& uncertainties,
                          FitStatistics& statistics,
                          std::vector<CalibrationNote>& notes);

/// Lengthens the intervals according to models of the noise. No interval becomes shorter. The
/// component "correlation" is added, or replaced if it exists.
/// @param uncertainties  standard uncertainties of the parameters.
void add_correlation(const Eigen::VectorXd& uncertainties,
                     double degrees_of_freedom,
                     FitStatistics& statistics);

/// Returns a note if a recording is short relative to the correlation length of its noise.
/// @param independent  equivalent number of independent readings in the recording.
/// @return one remark, or an empty list.
[[nodiscard]] std::vector<std::string> remarks_on_length(double independent);

}  // namespace axiscal
