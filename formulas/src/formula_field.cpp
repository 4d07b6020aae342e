// SPDX-License-Identifier: Apache-2.0
#include "axiscal/formulas/formula_field.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_resolver.hpp"
#include "axiscal/field/reference_field.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"
#include "formulas/src/formula.hpp"

namespace axiscal {
namespace {

constexpr std::string_view formula_kind = "formula";

class FormulaField final : public ReferenceField {
 public:
  [[nodiscard]] Eigen::Vector3d value_in_enu() const override { return value_in_enu_at(0.0); }

  [[nodiscard]] Eigen::Vector3d value_in_enu_at(double time_s) const override {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < components_.size(); ++j) {
      const std::array<double, 1> t = {time_s};
      value(static_cast<Eigen::Index>(j)) = components_[j] ? (*components_[j])(t) : 0.0;
    }
    if (!value.allFinite()) {
      throw RefusedError(
          formatted("the formulas of the field do not give a finite value at t = {}", time_s));
    }
    return value;
  }

  [[nodiscard]] bool moves() const override {
    return std::any_of(components_.begin(), components_.end(),
                       [](const auto& component) { return component && component->has("t"); });
  }

  [[nodiscard]] bool needs_utc() const override { return false; }
  [[nodiscard]] bool is_induced() const override { return frame_ == "table"; }
  [[nodiscard]] std::string_view unit() const override { return ""; }
  [[nodiscard]] std::string_view kind() const override { return formula_kind; }

  void resolve(FieldResolver& of) const override {
    if (!components_.front()) {
      throw SetupError(
          "field formula: define the formulas \"x\", \"y\" and \"z\" in a file (--field "
          "FILE.json)");
    }
    of.resolve_by_value(*this);
  }

  void members(JsonMembers& io) override {
    static constexpr std::array<const char*, 3> names = {"x", "y", "z"};
    for (std::size_t j = 0; j < names.size(); ++j) {
      std::string text = components_[j] ? components_[j]->text() : "";
      io.need(names[j], text);
      if (io.reads()) {
        io.check(names[j], [&] { components_[j].emplace(text, std::vector<std::string>{"t"}); });
      }
    }
    if (io.has("frame", frame_ != "table")) {
      io.need("frame", frame_);
      io.check("frame", frame_ == "table" || frame_ == "enu", "must be 'table' or 'enu'");
    }
  }

 private:
  std::array<std::optional<Formula>, 3> components_;
  std::string frame_ = "table";
};

}  // namespace

void add_formula_field() {
  static constexpr std::array<std::string_view, 4> members = {"x", "y", "z", "frame"};
  static const bool added = [] {
    add_field_kind(
        {.name = formula_kind, .units = {}, .members = members, .make = maker_of<FormulaField>()});
    return true;
  }();
  static_cast<void>(added);
}

}  // namespace axiscal
