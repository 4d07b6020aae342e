// SPDX-License-Identifier: Apache-2.0
#include "calib/fit/src/joint_solution.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the common scatter of all axes; 1 if the readings do not determine it.
double pooled_scatter(const ReadingSet& set, const Solution& state, double dof) {
  if (!(dof > 0.5)) {
    return 1.0;
  }
  return std::max(std::sqrt(state.sums.squares.sum() / dof), set.rounding());
}

// Returns the rounding error of each axis, which is the lower limit of its noise.
Eigen::VectorXd rounding_of_axes(const ReadingSet& set) {
  Eigen::VectorXd smallest(set.axis_count());
  for (Eigen::Index k = 0; k < smallest.size(); ++k) {
    smallest(k) = set.rounding(k);
  }
  return smallest;
}

// Alternately fits the directions of the field and estimates the noise of the axes, until the noise
// converges.
JointSolution solve_joint(const ReadingSet& set, const Model& model, const TableField& start) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(set.axis_count());
  const std::shared_ptr<const Solution> state =
      model.solved(model.at(model.start(start)), sigma).state;
  SharedCost shares = Model::cost_of_shared(*state, sigma);
  sigma.setConstant(pooled_scatter(set, *state, shares.degrees_of_freedom.sum()));
  shares.covariance *= sigma(0) * sigma(0);
  const JointSolution equal{.state = state, .sigma = sigma, .shares = shares};
  // With fewer degrees of freedom, an axis that fits well by chance could get all the weight.
  constexpr double fewest_degrees_of_freedom = 1.0;
  if (shares.degrees_of_freedom.minCoeff() < fewest_degrees_of_freedom) {
    return equal;
  }
  JointSolution solution = equal;
  solution.weights_are_estimated = true;
  const Eigen::VectorXd smallest = rounding_of_axes(set);
  constexpr int most_rounds = 30;  // three or four rounds are usual
  for (int round = 0; round < most_rounds; ++round) {
    const std::optional<AxisNoise> next = Model::noise(*solution.state, solution.sigma, smallest);
    if (!next || !(next->degrees_of_freedom.minCoeff() >= fewest_degrees_of_freedom)) {
      return equal;
    }
    const double change = (next->sigma.array() / solution.sigma.array()).log().abs().maxCoeff();
    solution.sigma = next->sigma;
    // The directions converge before the noise is estimated again. With single steps, the search
    // could cycle if the readings hardly determine the directions.
    solution.state = model.solved(solution.state, solution.sigma).state;
    constexpr double still = 1e-7;  // relative change of sigma; the next one would be far smaller
    if (change < still) {
      solution.shares = Model::cost_of_shared(*solution.state, solution.sigma);
      return solution;
    }
  }
  return equal;  // valid, but less accurate: it assumes equal noise of all axes
}

// Returns -2 ln of the likelihood, up to a constant.
double misfit(const ReadingSet& set, const Solution& state) {
  double sum = 0.0;
  for (Eigen::Index k = 0; k < set.axis_count(); ++k) {
    const AxisSolution& axis = state.axes[static_cast<std::size_t>(k)];
    const double least = std::pow(set.rounding(k), 2) * static_cast<double>(set.size());
    sum += static_cast<double>(axis.design->observations()) *
           std::log(std::max(state.sums.squares(k), least));
  }
  return sum;
}

// Returns the angle between the fields of two solutions. A field and its reverse are regarded as
// equal. Each part of the field is weighted by its size.
double angle_between(const Solution& a, const Solution& b) {
  double along = 0.0;
  double all = 0.0;
  for (std::size_t s = 0; s < a.field().size(); ++s) {
    const double size = b.field().vector(s).norm();
    along += size * a.field().vector(s).normalized().dot(b.field().vector(s).normalized());
    all += size;
  }
  return std::acos(std::min(1.0, std::abs(along) / all));
}

std::string direction_text(const Eigen::Vector3d& direction) {
  const auto rounded = [](double value) { return number_text(value, 2); };
  return formatted("{}, {}, {}", rounded(direction.x()), rounded(direction.y()),
                   rounded(direction.z()));
}

// Describes the other direction in words, for the part of the field that differs most.
std::string another_direction(const ReadingSet& set, const Solution& other, const Solution& best) {
  std::size_t part = 0;
  double least = 2.0;
  for (std::size_t s = 0; s < best.field().size(); ++s) {
    const double along =
        std::abs(other.field().vector(s).normalized().dot(best.field().vector(s).normalized()));
    if (along < least) {
      least = along;
      part = s;
    }
  }
  return formatted("the direction {} of {} in the table's frame fits the readings equally well",
                   direction_text(other.field().vector(part).normalized()),
                   set.field.name_of(part));
}

// Returns the solutions after a few rounds of the search from each start. If two solutions come
// closer than met_rad, only one of them is kept.
std::vector<std::shared_ptr<const Solution>> few_rounds_from(
    const ReadingSet& set, const Model& model, const std::vector<TableField>& starts) {
  constexpr int meetings = 3;
  constexpr int rounds_between = 4;
  constexpr double met_rad = 1e-4;  // closer solutions converge to the same point
  const Eigen::VectorXd equal = Eigen::VectorXd::Ones(set.axis_count());
  std::vector<std::shared_ptr<const Solution>> found;
  for (const TableField& start : starts) {
    found.push_back(model.at(model.start(start)));
  }
  for (int meeting = 0; meeting < meetings; ++meeting) {
    std::vector<std::shared_ptr<const Solution>> apart;
    for (const std::shared_ptr<const Solution>& state : found) {
      std::shared_ptr<const Solution> next =
          model.solved(state, equal, {.most_rounds = rounds_between}).state;
      const bool has_met = std::any_of(apart.begin(), apart.end(), [&](const auto& other) {
        return angle_between(*next, *other) < met_rad;
      });
      if (!has_met) {
        apart.push_back(std::move(next));
      }
    }
    found = std::move(apart);
  }
  return found;
}

}  // namespace

BestSolution best_solution(const ReadingSet& set,
                           const Model& model,
                           const std::vector<TableField>& starts) {
  if (starts.size() == 1) {
    return {.solution = solve_joint(set, model, starts.front()), .ambiguity = ""};
  }
  // The search makes a few rounds from each start. Then it continues from the best solution, and
  // from other solutions that fit equally well.
  constexpr double another_rad = 0.05;
  // Largest difference of -2 ln(likelihood) for an equally good fit; the likelihoods then differ by
  // a factor of 20.
  constexpr double as_likely = 6.0;
  const std::vector<std::shared_ptr<const Solution>> found = few_rounds_from(set, model, starts);
  const auto less = [&](const auto& a, const auto& b) { return misfit(set, *a) < misfit(set, *b); };
  const Solution& best = **std::min_element(found.begin(), found.end(), less);
  BestSolution result{.solution = solve_joint(set, model, best.field()), .ambiguity = ""};
  for (const std::shared_ptr<const Solution>& other : found) {
    if (angle_between(*other, best) < another_rad ||
        misfit(set, *other) > misfit(set, best) + as_likely) {
      continue;
    }
    JointSolution rival = solve_joint(set, model, other->field());
    if (angle_between(*rival.state, *result.solution.state) < another_rad ||
        misfit(set, *rival.state) > misfit(set, *result.solution.state) + as_likely) {
      continue;
    }
    if (misfit(set, *rival.state) < misfit(set, *result.solution.state)) {
      std::swap(rival, result.solution);
    }
    result.ambiguity = another_direction(set, *rival.state, *result.solution.state);
    break;
  }
  return result;
}

}  // namespace axiscal
