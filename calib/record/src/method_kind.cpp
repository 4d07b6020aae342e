// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/method_kind.hpp"

#include <algorithm>
#include <deque>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The rows of the table of methods, in the order of the enumerators of Method.
std::deque<MethodKind>& all_kinds() {
  static std::deque<MethodKind> kinds = {
      MethodKind{
          .method = Method::paired,
          .name = "paired",
          .by_pose = true,
          .averages_pairs = true,
          .words = "averages of opposite positions, which do not depend on the table's slope"},
      MethodKind{
          .method = Method::joint,
          .name = "joint",
          .by_pose = true,
          .words = "all readings; the field's direction relative to the table is also fitted"},
      MethodKind{.method = Method::known,
                 .name = "known",
                 .by_pose = true,
                 .directions_known = true,
                 .words = "fit of all readings with the stated field"},
      MethodKind{.method = Method::magnitude,
                 .name = "magnitude",
                 .by_magnitude = true,
                 .words = "fit to the field's magnitude, without known orientations"},
      MethodKind{.method = Method::bias,
                 .name = "bias",
                 .fits_sensitivity = false,
                 .words = "fit of the biases only"},
      MethodKind{.method = Method::turns,
                 .name = "turns",
                 .by_turns = true,
                 .is_chosen = false,
                 .words = "integration of the rates over the turns from rest to rest"},
      MethodKind{.method = Method::faces,
                 .name = "faces",
                 .by_pose = true,
                 .directions_known = true,
                 .by_length = true,
                 .words = "bias and scale from the field's magnitude on six faces, even if the "
                          "faces are tilted"}};
  return kinds;
}

constexpr MethodKind no_method{.name = ""};

}  // namespace

Method add_method_kind(MethodKind kind) {
  if (kind.name.empty() || parse_method(kind.name)) {
    throw DomainError(
        formatted("add_method_kind: '{}' is not a valid name, or it exists already", kind.name));
  }
  kind.method = static_cast<Method>(all_kinds().size());
  return all_kinds().emplace_back(kind).method;
}

const MethodKind& method_kind(Method method) {
  return all_kinds().at(static_cast<std::size_t>(method));
}

const MethodKind& method_kind(std::optional<Method> method) {
  return method ? method_kind(*method) : no_method;
}

std::string_view method_name(std::optional<Method> method) {
  return method_kind(method).name;
}

std::optional<Method> parse_method(std::string_view name) {
  const std::deque<MethodKind>& kinds = all_kinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](const MethodKind& kind) { return kind.name == name; });
  return found == kinds.end() ? std::nullopt : std::optional(found->method);
}

std::optional<Method> parse_chosen_method(std::string_view name) {
  const std::optional<Method> method = parse_method(name);
  return method && method_kind(*method).is_chosen ? method : std::nullopt;
}

}  // namespace axiscal
