// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The uncertainty of one quantity that follows from a calibration.
struct CombinedUncertainty {
  double u = 0.0;  ///< combined standard uncertainty [unit of the quantity]
  /// Effective degrees of freedom; may be infinite. If all shares of the variance have five or more
  /// degrees of freedom, this is the result of Welch and Satterthwaite's formula. Otherwise it is
  /// the number for which Student's t equals coverage_factor.
  double degrees_of_freedom = 0.0;
  double coverage_factor = 0.0;  ///< `expanded` divided by `u`
  double expanded = 0.0;         ///< half width of the 95 % interval
  /// Standard uncertainty from each source, in the order of UncertaintyBudget::sources.
  std::vector<double> by_source;
};

/// A part of a quantity's variance that is estimated from scatter, with its degrees of freedom.
struct VarianceShare {
  double variance = 0.0;
  double degrees_of_freedom = 0.0;
};

/// The variance of a quantity, divided into the shares of its sources.
struct AXISCAL_EXPORT VarianceShares {
  std::vector<VarianceShare> axes;        ///< shares of the readings' scatter, one for each axis
  std::vector<VarianceShare> components;  ///< shares of scatter components, e.g. between blocks
  double others = 0.0;                    ///< sum of the type B variances

  /// Adds the shares of an independent contribution to the quantity.
  VarianceShares& operator+=(const VarianceShares& more);
};

/// Computes the uncertainty of a quantity from the shares of its variance. If each share has five
/// degrees of freedom or more, the expanded uncertainty U follows from Welch and Satterthwaite's
/// formula. With fewer degrees of freedom, this formula gives intervals that are too short. Then
/// U^2 = sum (t_i u_i)^2 is used, where u_i^2 is share i and t_i is Student's t for its degrees of
/// freedom (method.md, section 8).
/// @param coverage  coverage probability of the expanded uncertainty.
/// @par Source
/// JCGM 100:2008, G.4.
[[nodiscard]] AXISCAL_EXPORT CombinedUncertainty combine(const VarianceShares& shares,
                                                         double coverage = 0.95);

/// @return the effective degrees of freedom of the variance by Welch and Satterthwaite's formula;
///         may be infinite. Unlike combine(), this function uses the formula for any degrees of
///         freedom of the shares.
[[nodiscard]] AXISCAL_EXPORT double welch_degrees_of_freedom(const VarianceShares& shares);

/// Student's t at one coverage probability, interpolated in a table. The result is accurate to
/// 0.4 %, and its computation is a hundred times as fast as that of the exact quantile. Use it for
/// streams of readings.
class AXISCAL_EXPORT CoverageFactors {
 public:
  /// @throws DomainError  unless 0 < coverage < 1.
  explicit CoverageFactors(double coverage = 0.95);

  /// @param degrees_of_freedom  1 or more; a smaller value is taken as 1.
  [[nodiscard]] double at(double degrees_of_freedom) const;

  /// @return the expanded uncertainty of combine(), with the interpolated t.
  [[nodiscard]] double expanded(const VarianceShares& shares) const;

 private:
  struct Nodes {
    std::vector<double> inverse;  // 1 / degrees of freedom, descending
    std::vector<double> log_t;
  };
  static Nodes nodes_of(double coverage);

  std::shared_ptr<const Nodes> nodes_;
};

/// Computes the uncertainty of a quantity that depends on the parameters.
///
/// @param calibration  a record with statistics. Without an uncertainty budget, the fit is the only
///                     source.
/// @param gradient     derivatives of the quantity with respect to the parameters, in the order of
///                     parameter_names.
/// @param shares       receives the shares of the variance; may be null.
[[nodiscard]] AXISCAL_EXPORT CombinedUncertainty propagate(const Calibration& calibration,
                                                           const Eigen::RowVectorXd& gradient,
                                                           VarianceShares* shares = nullptr);

/// @param gradient  derivatives of the quantity with respect to the parameters.
/// @return the shares of the quantity's variance that come from the scatter of the readings.
[[nodiscard]] AXISCAL_EXPORT VarianceShares scatter_shares(const Calibration& calibration,
                                                           const Eigen::RowVectorXd& gradient);

/// @return the covariance of the parameters from all sources; empty if the record lacks statistics.
[[nodiscard]] AXISCAL_EXPORT Eigen::MatrixXd parameter_covariance(const Calibration& calibration);

/// One parameter in a budget.
struct ParameterUncertainty {
  std::string name;  ///< "x.bias", ...
  double value = 0.0;
  CombinedUncertainty uncertainty;
};

/// @return all parameters, in the order of parameter_names; empty without statistics.
[[nodiscard]] AXISCAL_EXPORT std::vector<ParameterUncertainty> parameter_uncertainties(
    const Calibration& calibration);

/// @return true if every parameter has a finite, positive expanded uncertainty. It is false for 0
///         degrees of freedom.
[[nodiscard]] AXISCAL_EXPORT bool states_uncertainty(const Calibration& calibration);

/// @return the unit of a parameter of the record: "V", "V/g", "V per d2", "1 per d".
[[nodiscard]] AXISCAL_EXPORT std::string parameter_unit(const Calibration& calibration,
                                                        const std::string& name);

/// @return true if the budget includes the uncertainty of the field's magnitude, or if the method
///         (`bias` or `turns`) does not use the magnitude. If the result is false, the
///         uncertainties are not valid in SI units.
[[nodiscard]] AXISCAL_EXPORT bool counts_magnitude(const Calibration& calibration);

/// Lists the inputs that the uncertainties do not include, because the uncertainty of the input was
/// not stated. Such inputs are the cube's face normals (for a run on a table), the field's
/// magnitude and, for readings in an electrical unit, the electrical reference (for example the
/// voltage reference).
/// @return the inputs in words; empty without statistics.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string> not_counted(const Calibration& calibration);

/// @return the inputs of not_counted() in one sentence; empty if not_counted() is empty.
[[nodiscard]] AXISCAL_EXPORT std::string not_counted_sentence(const Calibration& calibration);

/// Advice on how to halve the combined uncertainty of a quantity.
struct Advice {
  std::string source;  ///< the source with the largest part of the variance
  double share = 0.0;  ///< part of the variance from this source, 0 to 1
  /// States how much this source must improve to halve the combined uncertainty. If no improvement
  /// is enough, states the uncertainty that remains without this source.
  std::string text;
};

/// @param uncertainty  uncertainty of one quantity.
/// @param sources      names of the sources, in the order of uncertainty.by_source.
/// @param readings     number of readings that the calibration used.
[[nodiscard]] AXISCAL_EXPORT Advice advice_to_halve(const CombinedUncertainty& uncertainty,
                                                    const std::vector<std::string>& sources,
                                                    int readings);

}  // namespace axiscal
