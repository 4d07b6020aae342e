// SPDX-License-Identifier: Apache-2.0
#include "axiscal/field/site.hpp"

#include <string>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

void check(double value, double low, double high, const char* name) {
  if (!(value >= low && value <= high)) {
    throw DomainError(formatted("site: {} must be from {} to {}, not {}", name, number_text(low),
                                number_text(high), number_text(value)));
  }
}

}  // namespace

void check_site(const Site& site) {
  check(site.latitude_deg, -90.0, 90.0, "latitude [degree]");
  check(site.longitude_deg, -180.0, 360.0, "longitude [degree]");
  check(site.height_m, -20e3, 1000e3, "height [m]");
}

}  // namespace axiscal
