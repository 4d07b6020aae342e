// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_level.hpp"

#include <utility>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {

FieldLevel::FieldLevel(OfParts of_parts, double of_others) : of_all_(of_others) {
  if (!of_parts.empty()) {
    of_parts_ = std::make_shared<const OfParts>(std::move(of_parts));
  }
}

const FieldLevel::OfParts& FieldLevel::of_parts() const {
  static const OfParts none;
  return of_parts_ ? *of_parts_ : none;
}

double FieldLevel::own_level(std::string_view part) const {
  const auto own = of_parts_->find(part);
  return own == of_parts_->end() ? of_all_ : own->second;
}

std::string FieldLevel::text() const {
  if (!of_parts_) {
    return number_text(of_all_);
  }
  std::vector<std::string> all;
  for (const auto& [name, level] : *of_parts_) {
    all.push_back(formatted("{} {}", name, number_text(level)));
  }
  return joined(all);
}

int FieldLevel::compare(const FieldLevel& a, const FieldLevel& b) {
  if (a.of_all_ != b.of_all_) {
    return a.of_all_ < b.of_all_ ? -1 : 1;
  }
  if (a.of_parts_ == b.of_parts_) {
    return 0;
  }
  if (!a.of_parts_ || !b.of_parts_) {
    return a.of_parts_ ? 1 : -1;
  }
  return *a.of_parts_ == *b.of_parts_ ? 0 : *a.of_parts_ < *b.of_parts_ ? -1 : 1;
}

}  // namespace axiscal
