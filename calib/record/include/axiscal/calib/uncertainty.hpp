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

/// The uncertainty of one quantity that a calibration gives.
struct CombinedUncertainty {
  double u = 0.0;  ///< combined standard uncertainty [unit of the quantity]
  /// Effective: those of which coverage_factor is Student's t, by Welch and Satterthwaite where all
  /// parts have five or more; may be infinite.
  double degrees_of_freedom = 0.0;
  double coverage_factor = 0.0;   ///< expanded / u
  double expanded = 0.0;          ///< half width of the 95 % interval
  std::vector<double> by_source;  ///< u of each source alone, in their order
};

/// A part of a quantity's variance that scatter says, with its degrees of freedom.
struct VarianceShare {
  double variance = 0.0;
  double degrees_of_freedom = 0.0;
};

/// The variance of a quantity by where it comes from.
struct AXISCAL_EXPORT VarianceShares {
  std::vector<VarianceShare> axes;        ///< of the readings' scatter, one for each axis
  std::vector<VarianceShare> components;  ///< of blocks, seats, ...
  double others = 0.0;                    ///< known well: infinite degrees of freedom

  /// Appends the shares of another, independent part.
  VarianceShares& operator+=(const VarianceShares& more);
};

/// Puts shares together: by Welch and Satterthwaite's formula where each has five degrees of
/// freedom or more, else U^2 = sum (t u_i)^2, as the formula is too short there (method.md, section
/// 8).
/// @param coverage  of the expanded uncertainty.
/// @par Source
/// JCGM 100:2008, G.4.
[[nodiscard]] AXISCAL_EXPORT CombinedUncertainty combine(const VarianceShares& shares,
                                                         double coverage = 0.95);

/// @return the effective degrees of freedom of the sum by Welch and Satterthwaite, however few any
///         part has; may be infinite.
[[nodiscard]] AXISCAL_EXPORT double welch_degrees_of_freedom(const VarianceShares& shares);

/// Student's t at one probability for any degrees of freedom, from a table: to 0.4 %, and a hundred
/// times as fast as the quantile; for streams.
class AXISCAL_EXPORT CoverageFactors {
 public:
  /// @throws DomainError  unless 0 < coverage < 1.
  explicit CoverageFactors(double coverage = 0.95);

  /// @param degrees_of_freedom  1 or more; fewer count as 1.
  [[nodiscard]] double at(double degrees_of_freedom) const;

  /// @return the half width of the interval, as combine().
  [[nodiscard]] double expanded(const VarianceShares& shares) const;

 private:
  struct Nodes {
    std::vector<double> inverse;  // 1 / nu, descending
    std::vector<double> log_t;
  };
  static Nodes nodes_of(double coverage);

  std::shared_ptr<const Nodes> nodes_;
};

/// The uncertainty of a quantity that depends on the parameters.
///
/// @param calibration  with statistics; its uncertainty, if there, else the fit alone.
/// @param gradient     of the quantity by the parameters, in the order of parameter_names.
/// @param shares       set to the same as variances; may be null.
[[nodiscard]] AXISCAL_EXPORT CombinedUncertainty propagate(const Calibration& calibration,
                                                           const Eigen::RowVectorXd& gradient,
                                                           VarianceShares* shares = nullptr);

/// @param gradient  of the quantity by the parameters.
/// @return the shares of the quantity's variance from the scatter of a fit.
[[nodiscard]] AXISCAL_EXPORT VarianceShares scatter_shares(const Calibration& calibration,
                                                           const Eigen::RowVectorXd& gradient);

/// @return covariance of the parameters from all sources; empty where none is stated.
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

/// @return whether every parameter has an expanded uncertainty: not without degrees of freedom.
[[nodiscard]] AXISCAL_EXPORT bool states_uncertainty(const Calibration& calibration);

/// @return the unit of a parameter of the record: "V", "V/g", "V per d2", "1 per d".
[[nodiscard]] AXISCAL_EXPORT std::string parameter_unit(const Calibration& calibration,
                                                        const std::string& name);

/// @return true if the budget includes the uncertainty of the field's magnitude, or if it does not
///         matter (methods bias and turns). Otherwise an uncertainty in SI units cannot be claimed.
[[nodiscard]] AXISCAL_EXPORT bool counts_magnitude(const Calibration& calibration);

/// Inputs that the stated uncertainty leaves out, because their uncertainty was not stated: for a
/// run on a table the cube's face normals and the field's magnitude; for readings in volts or
/// amperes their reference.
/// @return in words, to stand behind "not counted: "; empty without statistics.
[[nodiscard]] AXISCAL_EXPORT std::vector<std::string> not_counted(const Calibration& calibration);

/// @return that in a sentence; empty where all is counted.
[[nodiscard]] AXISCAL_EXPORT std::string words_of_not_counted(const Calibration& calibration);

/// The action against the largest source.
struct Advice {
  std::string source;  ///< the one with the largest part of the variance
  double share = 0.0;  ///< that part
  std::string text;    ///< an action that would halve the combined uncertainty
};

/// @param uncertainty  of one quantity, its parts in the order of the budget's sources.
/// @param sources      names of the sources of by_source.
/// @param readings     how many readings the calibration used.
[[nodiscard]] AXISCAL_EXPORT Advice advice_to_halve(const CombinedUncertainty& uncertainty,
                                                    const std::vector<std::string>& sources,
                                                    int readings);

}  // namespace axiscal
