// SPDX-License-Identifier: Apache-2.0
#include "core/json_members.hpp"

namespace axiscal {

void JsonMembers::take(const JsonValue& from, std::vector<int>& all) {
  all.clear();
  for (const JsonValue& element : from.elements()) {
    all.push_back(element.integer());
  }
}

void JsonMembers::xy(const char* key, double& x, double& y) {
  if (reads()) {
    x = not_a_number;
    y = not_a_number;
  }
  object(key, true, [&](JsonMembers& io) {
    io.number("x", x);
    io.number("y", y);
  });
}

void JsonMembers::need_pair(const char* key, double& low, double& high) {
  if (!reads()) {
    require(std::isfinite(low) && std::isfinite(high), key, "must be finite numbers");
    put(key, Eigen::Vector2d(low, high));
    return;
  }
  const Eigen::VectorXd ends = from_->at(key).vector(2);
  low = ends(0);
  high = ends(1);
}

}  // namespace axiscal
