// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/turn_unknowns.hpp"

#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "calib/record/parameter_names.hpp"
#include "calib/regression/factor.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

std::vector<std::string> names_of_unknowns(Eigen::Index unknowns) {
  const std::vector<std::string> axes = {"x", "y", "z"};
  std::vector<std::string> names = names_of_columns(axes, {1, 2, 3}, {});
  const std::vector<std::string> biases = names_of_columns(axes, {0}, {});
  names.insert(names.end(), biases.begin(), biases.end());
  names.resize(static_cast<std::size_t>(unknowns));
  return names;
}

// Finds the unknowns that the turns do not determine. Noise makes the singular value of an
// undetermined direction larger than 0, but it remains about a hundred times smaller than the
// others.
std::vector<Eigen::Index> open_unknowns(const Eigen::MatrixXd& J) {
  constexpr double open_below = 5e-3;
  return confounded_columns(J, open_below, 0.1);
}

}  // namespace

bool leaves_room(const Eigen::MatrixXd& J) {
  constexpr double little = 0.1;
  const Eigen::VectorXd lengths = J.colwise().norm();
  return lengths.minCoeff() < little * lengths.maxCoeff() || !open_unknowns(J).empty();
}

void require_determined(const Eigen::MatrixXd& J, const TurnFit& fit, std::size_t turns) {
  std::vector<std::string> open =
      undetermined_column_names(open_unknowns(J), names_of_unknowns(J.cols()));
  if (!open.empty()) {
    const std::string list = joined(open);
    throw RankDeficientError(
        formatted("the {} turns do not determine {}; turn the instrument about each of its axes, "
                  "at least a quarter turn from rest to rest{}",
                  turns, list,
                  fit.has_rotations ? ""
                                    : "; turns about only the vertical do not help, because the "
                                      "accelerometer does not measure them"),
        std::move(open));
  }
}

}  // namespace axiscal
