// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/formatted.hpp"
#include "part_resolver.hpp"

namespace axiscal {

void resolve_custom(PartResolver& of) {
  if (!of.given_magnitude() && of.part().unit != "1") {
    throw SetupError(
        formatted(
            "field custom in {}: its magnitude is not known; state it, or its vector in the table",
            of.part().unit),
        {Setting::field_table, Setting::field_magnitude});
  }
  of.put_magnitude(of.given_magnitude().value_or(1.0));
}

}  // namespace axiscal
