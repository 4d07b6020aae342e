// SPDX-License-Identifier: Apache-2.0
#include "axiscal/formulas/kind_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <string_view>
#include <utility>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "formulas/src/formula.hpp"

namespace axiscal {
namespace {

struct StatedQuantity {
  std::string name;
  std::string unit;
  Formula formula;
};

// The content of a file that describes a kind of instrument. It exists until the program ends,
// because an InstrumentKind refers to it.
struct StatedKind {
  std::string path;
  std::string name;
  std::string usual_field;
  std::vector<std::string> derived_names;
  std::vector<std::string_view> derived_views;
  std::vector<Formula> derived;
  std::vector<StatedQuantity> quantities;
};

constexpr double nan = not_a_number;

DerivedValues derive(const StatedKind& kind, const DeriveInput& input) {
  const Eigen::Vector3d up = input.up.value_or(Eigen::Vector3d(nan, nan, nan));
  const Eigen::Vector3d& f = input.field_in_sensor;
  const std::array<double, 7> values = {f.x(),  f.y(),  f.z(), input.magnitude,
                                        up.x(), up.y(), up.z()};
  DerivedValues result;
  for (std::size_t i = 0; i < kind.derived.size(); ++i) {
    result.values[i] = kind.derived[i](values);
  }
  return result;
}

// Returns the value of a formula for an axis, and its standard uncertainty. The derivatives of the
// formula are central differences.
std::pair<double, double> value_and_u(const Formula& formula,
                                      std::array<double, 5> at,
                                      const Eigen::MatrixXd& covariance) {
  const double value = formula(at);
  if (covariance.rows() != 4) {
    return {value, nan};
  }
  Eigen::Vector4d gradient;
  for (Eigen::Index j = 0; j < 4; ++j) {
    double& x = at[static_cast<std::size_t>(j)];
    const double here = x;
    const double u = std::sqrt(covariance(j, j));
    const double h = u > 0.0 ? 0.1 * u : 1e-6 * std::max(1.0, std::abs(here));
    x = here + h;
    const double above = formula(at);
    x = here - h;
    gradient(j) = (above - formula(at)) / (2.0 * h);
    x = here;
  }
  return {value, std::sqrt(gradient.dot(covariance * gradient))};
}

std::vector<KindQuantity> describe(const StatedKind& kind, const CalibratedInstrument& calibrated) {
  const Eigen::Index m = calibrated.response.bias.size();
  std::vector<KindQuantity> all;
  for (const StatedQuantity& quantity : kind.quantities) {
    for (Eigen::Index k = 0; k < m; ++k) {
      const Eigen::RowVector3d S = calibrated.response.sensitivity.row(k);
      const bool known = calibrated.covariance.rows() == 4 * m;
      const auto [value, u] =
          value_and_u(quantity.formula,
                      {calibrated.response.bias(k), S.x(), S.y(), S.z(), calibrated.magnitude},
                      known ? Eigen::MatrixXd(calibrated.covariance.block<4, 4>(4 * k, 4 * k))
                            : Eigen::MatrixXd());
      all.push_back({.name = quantity.name,
                     .of = calibrated.instrument.axes[static_cast<std::size_t>(k)],
                     .values = {value},
                     .u = {u},
                     .unit = quantity.unit});
    }
  }
  return all;
}

// Parses the formula of each entry {"name", "formula", ..} of a list, and passes it to `take`.
template <typename Take>
void for_each_formula(const JsonValue& file,
                      std::string_view key,
                      std::span<const std::string_view> keys,
                      const std::vector<std::string>& variables,
                      const Take& take) {
  const std::optional<JsonValue> list = file.find(key);
  for (const JsonValue& one : list ? list->elements() : std::vector<JsonValue>{}) {
    one.allow_keys(keys);
    one.check([&] { take(one, Formula(one.at("formula").text(), variables)); });
  }
}

void read_into(StatedKind& kind, const JsonValue& file) {
  static constexpr std::array<std::string_view, 6> keys = {"format",      "version", "name",
                                                           "usual_field", "derived", "quantities"};
  static constexpr std::array<std::string_view, 2> keys_of_derived = {"name", "formula"};
  static constexpr std::array<std::string_view, 3> keys_of_quantity = {"name", "formula", "unit"};
  file.require_format("axiscal-instrument-kind");
  file.allow_keys(keys);
  kind.name = file.at("name").text();
  kind.usual_field = file.text_or("usual_field");
  for_each_formula(file, "derived", keys_of_derived, {"x", "y", "z", "F", "up_x", "up_y", "up_z"},
                   [&](const JsonValue& one, Formula formula) {
                     kind.derived_names.push_back(one.at("name").text());
                     kind.derived.push_back(std::move(formula));
                   });
  for_each_formula(file, "quantities", keys_of_quantity, {"bias", "sx", "sy", "sz", "F"},
                   [&](const JsonValue& one, Formula formula) {
                     kind.quantities.push_back({.name = one.at("name").text(),
                                                .unit = one.text_or("unit"),
                                                .formula = std::move(formula)});
                   });
  kind.derived_views.assign(kind.derived_names.begin(), kind.derived_names.end());
}

bool needs_up(const StatedKind& kind) {
  return std::any_of(kind.derived.begin(), kind.derived.end(), [](const Formula& formula) {
    return formula.has("up_x") || formula.has("up_y") || formula.has("up_z");
  });
}

}  // namespace

const InstrumentKind& add_instrument_kind_file(const std::string& path) {
  static std::deque<StatedKind> stated;
  for (const StatedKind& known : stated) {
    if (known.path == path) {
      return find_instrument_kind(known.name);
    }
  }
  StatedKind read;
  read.path = path;
  read_into(read, parse_json(read_whole_file(path), path));
  // If the kind cannot be added below, its data are removed from `stated` again.
  const StatedKind& kind = stated.emplace_back(std::move(read));
  InstrumentKind entry{.name = kind.name,
                       .derived_names = kind.derived_views,
                       .derives_with_attitude = needs_up(kind),
                       .usual_field = kind.usual_field};
  if (!kind.derived.empty()) {
    entry.derive = [&kind](const DeriveInput& input) { return derive(kind, input); };
  }
  if (!kind.quantities.empty()) {
    entry.describe = [&kind](const CalibratedInstrument& calibrated) {
      return describe(kind, calibrated);
    };
  }
  try {
    return add_instrument_kind(entry);
  } catch (const DomainError& error) {
    stated.pop_back();
    throw DataError(path, error.what());
  }
}

}  // namespace axiscal
