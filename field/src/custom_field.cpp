// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/custom_field.hpp"

#include <utility>

#include "axiscal/core/error.hpp"

namespace axiscal {

CustomField::CustomField(const Eigen::Vector3d& value_in_enu, std::string unit)
    : value_in_enu_(value_in_enu), unit_(std::move(unit)) {
  if (!value_in_enu.allFinite() || !(value_in_enu.norm() > 0.0)) {
    throw DomainError("CustomField: the vector must be finite and not zero");
  }
}

}  // namespace axiscal
