// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"

namespace axiscal {

/// Whether there are so many readings that tenths of them tell how well the coefficients are
/// determined.
[[nodiscard]] bool is_long_recording(Eigen::Index readings);

/// Consecutive readings of a long recording are alike, so the covariance becomes that which leaving
/// out its tenths says, as a component "correlation" with 9 degrees of freedom; the intervals
/// follow.
///
/// @param uncertainties  of the parameters, by jackknife_uncertainty(). If one is NaN, only a note
///                       is added.
/// @par Source
/// method.md, section 4.
void add_long_correlation(const Eigen::VectorXd& uncertainties,
                          FitStatistics& statistics,
                          std::vector<CalibrationNote>& notes);

/// As above, by models of the noise. Intervals become longer if the models ask for it, and a
/// component "correlation" is added or increased.
/// @param uncertainties  of the parameters, with so many degrees of freedom.
void add_correlation(const Eigen::VectorXd& uncertainties,
                     double degrees_of_freedom,
                     FitStatistics& statistics);

/// The note about a recording that is short relative to the correlation of its noise.
/// @param independent  as how many independent readings it counts.
/// @return none, or one remark.
[[nodiscard]] std::vector<std::string> remarks_on_length(double independent);

}  // namespace axiscal
