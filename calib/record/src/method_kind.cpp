// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/method_kind.hpp"

#include <algorithm>
#include <array>

namespace axiscal {
namespace {

constexpr std::array kinds = {
    MethodKind{.method = Method::paired,
               .name = "paired",
               .by_pose = true,
               .averages_pairs = true,
               .words = "opposite positions averaged, which removes the table's slope"},
    MethodKind{.method = Method::joint,
               .name = "joint",
               .by_pose = true,
               .words = "all readings, the field's direction in the table fitted with them"},
    MethodKind{.method = Method::known,
               .name = "known",
               .by_pose = true,
               .directions_known = true,
               .words = "the field taken as given"},
    MethodKind{.method = Method::magnitude,
               .name = "magnitude",
               .by_magnitude = true,
               .words = "orientations unknown"},
    MethodKind{
        .method = Method::bias, .name = "bias", .fits_sensitivity = false, .words = "biases alone"},
    MethodKind{.method = Method::turns,
               .name = "turns",
               .by_turns = true,
               .is_chosen = false,
               .words = "the attitudes after turns from rest to rest, by integration"},
    MethodKind{.method = Method::faces,
               .name = "faces",
               .by_pose = true,
               .directions_known = true,
               .by_length = true,
               .words = "six faces that may lean, bias and scale by the field's length"}};

constexpr MethodKind no_method{.name = ""};

}  // namespace

const MethodKind& method_kind(Method method) {
  return kinds.at(static_cast<std::size_t>(method));
}

const MethodKind& method_kind(std::optional<Method> method) {
  return method ? method_kind(*method) : no_method;
}

std::string_view method_name(std::optional<Method> method) {
  return method_kind(method).name;
}

std::optional<Method> parse_method(std::string_view name) {
  const auto* const found = std::find_if(kinds.begin(), kinds.end(),
                                         [&](const MethodKind& kind) { return kind.name == name; });
  return found == kinds.end() ? std::nullopt : std::optional(found->method);
}

std::optional<Method> parse_chosen_method(std::string_view name) {
  const std::optional<Method> method = parse_method(name);
  return method && method_kind(*method).is_chosen ? method : std::nullopt;
}

}  // namespace axiscal
