// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/field_level.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "axiscal/core/formatted.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {

FieldLevel::FieldLevel(std::map<std::string, double, std::less<>> of_parts, double of_others)
    : of_all_(of_others) {
  if (!of_parts.empty()) {
    of_parts_ =
        std::make_shared<const std::map<std::string, double, std::less<>>>(std::move(of_parts));
  }
}

double FieldLevel::own_level(std::string_view part) const {
  const auto own = of_parts_->find(part);
  return own == of_parts_->end() ? of_all_ : own->second;
}

bool FieldLevel::is_zero() const {
  return of_parts_ ? std::all_of(of_parts_->begin(), of_parts_->end(),
                                 [](const auto& part) { return part.second == 0.0; })
                   : of_all_ == 0.0;
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
