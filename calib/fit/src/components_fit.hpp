// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "calib/fit/fit.hpp"
#include "calib/fit/input_quantities.hpp"
#include "calib/fit/layings.hpp"
#include "calib/fit/src/curvature.hpp"
#include "calib/regression/variance_components.hpp"

namespace axiscal {

// The fit of readings that share errors, by generalised least squares. weigh_shared_errors()
// explains the model.
class ComponentsFit {
 public:
  // @param layings  means over consecutive readings at one design point.
  // @param run      these means with their solution.
  // All references must outlive this object.
  ComponentsFit(const MeanReadings& layings,
                const SolvedReadings& run,
                const std::vector<InputQuantity>& inputs,
                bool seats,
                const Estimate& start);

  // Returns true if the variance of the cube's rotation at its seats could exceed the final limit
  // of 1.6 standard errors. This first check uses a fit without the rotation, in which the standard
  // error is smaller.
  [[nodiscard]] bool may_see_seats();

  // Estimates the variances, the coefficients and the field in rounds until they converge.
  // @param seats_at_least  lower limit for the degrees of freedom of the variance of the cube's
  //                        rotation at its seats; 0: no limit. The search ends at the first round
  //                        below the limit, because later rounds hardly change this number.
  // @return false if the readings do not determine the fit, or if the degrees of freedom are below
  //         seats_at_least.
  bool solve(double seats_at_least = 0.0);

  // Returns true if the readings of a laying share an error besides the cube's rotation. This fit
  // does not use the scatter of the readings within the layings. If the readings share an error,
  // its noise of the means is clearly larger than this scatter.
  [[nodiscard]] bool exceeds_scatter_within(const MeanReadings& layings) const;

  // Tests for curvature of the axes by adding the columns f_k^2 to the fit. f_k is the initial
  // field along axis k.
  [[nodiscard]] std::optional<CurvatureTest> curvature();

  // Returns the standard deviation [rad], about each axis, of the cube's rotation between
  // placements. It is 0 if the rotation is not fitted or not found.
  [[nodiscard]] double seat_sd() const;

  // Returns true if the variance of the cube's rotation at its seats has more than the given
  // degrees of freedom. A variance theta with the standard error u has 2 (theta / u)^2 degrees of
  // freedom.
  [[nodiscard]] bool sees_seats(double degrees_of_freedom) const;

  void put(Estimate& estimate) const;

  // Adds the error that the readings of a laying share, besides the cube's rotation, as a component
  // of the scatter. put() was called before.
  void put_errors_of(const MeanReadings& layings, Estimate& estimate) const;

  // Predicts the effect of the inputs' errors on the readings of a set; n x m.
  // @param inputs  the uncertain inputs for the readings of `set`.
  [[nodiscard]] Eigen::MatrixXd shared_parts(const ReadingSet& set,
                                             const std::vector<InputQuantity>& inputs) const;

  // Returns the contribution of each input to the coefficients' covariance.
  [[nodiscard]] std::vector<Eigen::MatrixXd> shares() const;

 private:
  [[nodiscard]] Fit about_field();

  void take_coefficients(const Eigen::VectorXd& solution);

  [[nodiscard]] std::optional<CurvatureFit> fit_problem(const VarianceProblem& problem,
                                                        const Eigen::VectorXd& variances) const;

  [[nodiscard]] IndependentCurvature bent_axes(const Fit& run) const;

  [[nodiscard]] double degrees_of_freedom(Eigen::Index axis) const;

  // Returns for each reading the squared field along an axis, times the square root of the weight.
  [[nodiscard]] Eigen::VectorXd squares_of(const Fit& run, Eigen::Index k) const;

  // Returns the columns f_k^2, one for each axis; (n m) x m.
  [[nodiscard]] Eigen::MatrixXd with_squares(const Fit& run) const;

  [[nodiscard]] Eigen::Index errors() const;

  // Returns the starting variances of a round. If the seats' variance is 0, it starts above 0, so
  // that it can increase.
  [[nodiscard]] Eigen::VectorXd start() const;

  [[nodiscard]] VarianceProblem problem(const Fit& run) const;

  const ReadingSet& set_;
  const MeanReadings& layings_;
  const SolvedReadings& run_;
  const std::vector<InputQuantity>& inputs_;
  bool seats_;
  TableField field_;
  // the noise variances of the m axes, then the variance of the seats if it is fitted
  Eigen::VectorXd variances_;
  Eigen::VectorXd smallest_;
  Eigen::MatrixXd coefficients_;  // p x m
  std::optional<VarianceFit> fit_;
};

}  // namespace axiscal
