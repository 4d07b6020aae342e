// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"
#include "calib/fit/estimation.hpp"

namespace axiscal {

/// Method `magnitude`: fits readings with unknown orientations in a field of known magnitude
/// (method.md, section 4).
///
/// @param set    readings of three axes.
/// @param F      magnitude of the field.
/// @param noise  covariance of a reading up to a factor; the identity if the axes have equal noise.
/// @param squares  true if a squared term of each axis is fitted too.
/// @throws RefusedError, RankDeficientError  if there are not three axes, if there are fewer than
///                                           ten readings, or if the orientations do not determine
///                                           the coefficients.
[[nodiscard]] Estimate estimate_magnitude(const ReadingSet& set,
                                          double F,
                                          MagnitudeShape shape,
                                          const Eigen::Matrix3d& noise,
                                          bool squares = false);

/// Fits an ellipse to the readings of two axes that were rotated about the direction perpendicular
/// to both.
///
/// The matrix A = S^-1 of the two axes is assumed to be symmetric. The response to a field
/// perpendicular to the plane cannot be observed; its sensitivities are 0 in the result.
/// @param F  magnitude of the field's component in the plane of the two axes.
/// @throws RefusedError  for fewer than eight readings, or if they do not lie on an ellipse.
[[nodiscard]] Estimate estimate_ellipse(const ReadingSet& set, double F);

/// Fits the sessions of one instrument separately; each session is a block of the set. Each
/// coefficient of the result is a weighted mean over the sessions. The weights depend on the noise
/// within each session and on the scatter between the sessions.
///
/// @return the combined estimate. If there is only one session, or if a session does not determine
///         the coefficients, it is the result of estimate_magnitude() for all readings.
/// @par Source
/// Paule & Mandel, J. Res. NBS 87 (1982) 377-385; Hartung & Knapp, Stat. Med. 20 (2001) 3875-3889.
[[nodiscard]] Estimate estimate_sessions(const ReadingSet& set,
                                         double F,
                                         MagnitudeShape shape,
                                         const Eigen::Matrix3d& noise,
                                         bool squares = false);

/// Rotates the sensor's frame, which method `magnitude` leaves undetermined, to fit the design
/// points (Wahba's problem).
/// @param estimate  the result of method `magnitude`. The call rotates its response and stores the
///                  field in the table's frame.
void align_by_points(const ReadingSet& set, double F, Estimate& estimate);

/// Fits simulated readings by method `magnitude`, starting at the response `start`.
[[nodiscard]] LinearResponse refit_magnitude(const Eigen::MatrixXd& readings,
                                             double F,
                                             MagnitudeShape shape,
                                             const LinearResponse& start);

/// Computes the fields from readings of three axes. Each row v is converted to (v - b) S^-T; the
/// result is n x 3.
[[nodiscard]] Eigen::MatrixXd fields_of_readings(const LinearResponse& response,
                                                 const Eigen::MatrixXd& readings);

/// Transforms a response and its covariance to another frame: f_new = R f.
void turn_frame(const Eigen::Matrix3d& R, LinearResponse& response, Eigen::MatrixXd& covariance);

/// Transforms the statistics of a response to another frame: the covariance, its components and the
/// intervals.
void turn_frame(const Eigen::Matrix3d& R, FitStatistics& statistics);

}  // namespace axiscal
