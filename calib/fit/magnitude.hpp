// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Orientations unknown, only the field's magnitude known (method.md, section 4).
///
/// @param set    readings of three axes; their weights and responses count.
/// @param F      magnitude of the field.
/// @param noise  covariance of a reading up to a factor; 1 where the axes are alike.
/// @param squares  true fits a squared term of each axis too.
/// @throws RefusedError, RankDeficientError  for other than three axes, fewer than ten readings, or
///                                           orientations that leave coefficients open.
[[nodiscard]] Estimate estimate_magnitude(const ReadingSet& set,
                                          double F,
                                          MagnitudeShape shape,
                                          const Eigen::Matrix3d& noise,
                                          bool squares = false);

/// The fit of two axes that were turned about the direction perpendicular to both: an ellipse in
/// their plane.
///
/// A = S^-1 is symmetric. The response of the axes to a field across the plane is not observable;
/// its entries are 0.
/// @param F  length of the field in the plane.
/// @throws RefusedError  for fewer than eight readings, or readings on no ellipse.
[[nodiscard]] Estimate estimate_ellipse(const ReadingSet& set, double F);

/// Several sessions of one instrument, each a block of the set. Each session is fitted alone. A
/// coefficient is the weighted mean of the sessions; the weights include a session's noise and the
/// scatter between sessions.
///
/// @return as estimate_magnitude() of all readings where there is one session, or one of them does
///         not determine the coefficients.
/// @par Source
/// Paule & Mandel, J. Res. NBS 87 (1982) 377-385; Hartung & Knapp, Stat. Med. 20 (2001) 3875-3889.
[[nodiscard]] Estimate estimate_sessions(const ReadingSet& set,
                                         double F,
                                         MagnitudeShape shape,
                                         const Eigen::Matrix3d& noise,
                                         bool squares = false);

/// Turns the sensor's frame, which `magnitude` leaves open, by the design points (Wahba's problem).
/// @param estimate  its response is turned, its fields become the one in the table.
void align_by_points(const ReadingSet& set, double F, Estimate& estimate);

/// Refits readings. The search starts from a fit that is near; simulations use it.
[[nodiscard]] LinearResponse refit_magnitude(const Eigen::MatrixXd& readings,
                                             double F,
                                             MagnitudeShape shape,
                                             const LinearResponse& start);

/// The fields that readings of three axes say: (v - b) S^-T, n x 3.
[[nodiscard]] Eigen::MatrixXd fields_of_readings(const LinearResponse& response,
                                                 const Eigen::MatrixXd& readings);

/// Response and its covariance in another frame: f_new = R f.
void turn_frame(const Eigen::Matrix3d& R, LinearResponse& response, Eigen::MatrixXd& covariance);

/// Statistics of such a response in another frame: covariance, its components, intervals.
void turn_frame(const Eigen::Matrix3d& R, FitStatistics& statistics);

}  // namespace axiscal
