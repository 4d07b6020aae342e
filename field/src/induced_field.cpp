// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/induced_field.hpp"

#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/field_setup.hpp"

namespace axiscal {

InducedField::InducedField(std::string kind,
                           const Eigen::Vector3d& value_in_table,
                           std::string unit)
    : kind_(std::move(kind)), value_(value_in_table), unit_(std::move(unit)) {
  if (!value_in_table.allFinite() || !(value_in_table.norm() > 0.0)) {
    throw DomainError("InducedField: the vector must be finite and not zero");
  }
}

// If files can state the kind, the setup gets a field of that kind with this vector.
void InducedField::state(FieldSetup& setup) const {
  setup.unit = unit_;
  if (field_kind(kind_).make != nullptr) {
    setup.of = make_field(kind_);
    setup.role = FieldRole::induced;
    setup.in_table = value_;
  }
}

}  // namespace axiscal
