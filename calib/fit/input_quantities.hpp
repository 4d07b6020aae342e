// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/uncertainty_budget.hpp"
#include "calib/fit/fit.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// Computes the derivative of a reading's field in the positioner's frame with respect to the face
/// normals; 3 x 18, faces in the order of Face. Only the columns of the rest and fence faces are
/// nonzero.
///
/// The normals of the rest and fence faces are n_r and n_f. The axes of the table are z = -n_r, y =
/// n_f minus its component along z (normalised), and x = y cross z (method.md, section 2). Their
/// derivatives are dz = -dn_r, dy = x (x . dn_f) - z (y . dz), and dx = -y (x . dn_f) - z (x . dz).
///
/// @param rotation_table_from_positioner  the matrix with the rows x, y, z.
/// @param field_in_table  the field in the table's frame at the reading's level.
[[nodiscard]] Eigen::Matrix<double, 3, 18> change_with_normals(
    const Eigen::Matrix3d& rotation_table_from_positioner,
    const DesignPoint& point,
    const Eigen::Vector3d& field_in_table);

/// An uncertain input of the fit. Its error affects several readings. The fit, the uncertainty
/// budget and the forecast all use this description.
struct InputQuantity {
  std::string name;  ///< the name of the source in the budget
  double u = 0.0;    ///< standard uncertainty of the input; NaN if one number does not suffice
  std::string unit;  ///< the unit of u
  std::string distribution = "normal";
  Eigen::Index parts = 0;  ///< number q of independent errors with standard deviation 1
  /// Derivative of the field in the sensor's frame with respect to the q errors, 3 x q. The
  /// arguments are the indices of the reading and of the axis, and the field.
  std::function<Eigen::Matrix3Xd(Eigen::Index, Eigen::Index, const TableField&)> change;
};

/// Returns the uncertain inputs: the cube's face normals with their covariance and, if the field is
/// given, the table's slope and the field's direction with their stated uncertainties.
///
/// @param set    must outlive the result.
/// @param field  the fitted or given field; if it has no vectors, the result is empty.
[[nodiscard]] std::vector<InputQuantity> input_quantities(const Experiment& experiment,
                                                          const ReadingSet& set,
                                                          bool known_field,
                                                          const TableField& field);

/// Returns the uncertain orientation of the instrument in the cube as an input: independent
/// rotations about the three axes of the instrument, each with the standard uncertainty u_rad.
/// @param set  must outlive the result.
[[nodiscard]] InputQuantity mount_quantity(double u_rad, const ReadingSet& set);

/// Computes the derivatives of the readings with respect to the errors of the inputs. The result
/// has one column for each error. Its rows are those of Fit::columns(), in units of the sigma of
/// `run`.
[[nodiscard]] Eigen::MatrixXd input_error_jacobian(const std::vector<InputQuantity>& inputs,
                                                   const Fit& run,
                                                   const TableField& field);

/// @param shares  contribution of each input to the covariance of the coefficients.
/// @return the inputs as sources of the uncertainty budget.
[[nodiscard]] std::vector<UncertaintySource> sources_of(const std::vector<InputQuantity>& inputs,
                                                        std::vector<Eigen::MatrixXd> shares);

}  // namespace axiscal
