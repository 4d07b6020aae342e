// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/estimation.hpp"
#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// How a reading's field in the sensor changes with the normals of rest and fence face; 3 x 18,
/// faces in the order of Face.
///
/// With z = -n_r, y = n_f less its part along z, x = y cross z (method.md, section 2):
/// dz = -dn_r,  dy = x (x . dn_f) - z (y . dz),  dx = -y (x . dn_f) - z (x . dz).
///
/// @param rotation_table_from_positioner  rows x, y, z.
/// @param field_in_table  at the reading's level.
[[nodiscard]] Eigen::Matrix<double, 3, 18> change_with_normals(
    const Eigen::Matrix3d& rotation_table_from_positioner,
    const DesignPoint& point,
    const Eigen::Vector3d& field_in_table);

/// An input of the fit that is not exactly known, and whose error the readings share.
struct UncertainInput {
  std::string name;        ///< what the source is called in the budget
  double u = 0.0;          ///< its standard uncertainty; NaN where it is no single number
  std::string unit;        ///< what u is in
  Eigen::Index parts = 0;  ///< q independent errors of standard deviation 1
  /// How the field in the sensor changes with them, 3 x q, at one reading.
  std::function<Eigen::Matrix3Xd(Eigen::Index, const std::vector<Eigen::Vector3d>&)> change;
};

/// The cube's face normals by their covariance; and, where the field is given, the table's slope
/// and the field's direction by their stated uncertainties.
///
/// @param set     must outlive the result.
/// @param fields  in the table, as fitted or given; empty: there are none.
[[nodiscard]] std::vector<UncertainInput> uncertain_inputs(
    const Experiment& experiment,
    const ReadingSet& set,
    bool known_field,
    const std::vector<Eigen::Vector3d>& fields);

/// Fits again with inputs that are uncertain: generalised least squares,
/// V = diag(sigma_k^2 / w) + H C H^T, sigma_k by restricted likelihood (method.md, section 8).
///
/// Done as a mixed model: the inputs' errors are unknowns with a prior, so that only one
/// regression of readings on coefficients, directions and errors is needed. All readings enter,
/// with the field's direction unknown unless the method knows it.
///
/// @param set         the readings; weight 0 leaves one out.
/// @param estimate    of the ordinary fit; coefficients, fields, residual_sd, degrees of freedom
/// and
///                    covariance (of the scatter alone) are replaced.
/// @param known_field whether the directions in estimate.fields are given.
/// @return what each input leaves in the coefficients' covariance; nothing, and the estimate as it
///         was, where the readings do not determine all of it.
/// @par Source
/// Searle, Casella & McCulloch, Variance Components (1992), secs. 6.6, 7.6.
[[nodiscard]] std::optional<std::vector<Eigen::MatrixXd>> fit_with_uncertain_inputs(
    const ReadingSet& set,
    const std::vector<UncertainInput>& inputs,
    bool known_field,
    Estimate& estimate);

/// Weighs in a fit those of an experiment's inputs that are uncertain, as their errors show in its
/// residuals too; says in the estimate's notes what could not be weighed.
///
/// @param set  the readings that were fitted.
/// @return what each leaves in the coefficients; none where nothing was weighed.
[[nodiscard]] std::vector<UncertaintySource> weigh_inputs(const Experiment& experiment,
                                                          const ReadingSet& set,
                                                          Method method,
                                                          Estimate& estimate);

}  // namespace axiscal
