// SPDX-License-Identifier: Apache-2.0
#include "field/src/field_members.hpp"

namespace axiscal {

void model_members(JsonMembers& io, std::string& model, const std::string& usual) {
  if (io.has("model", model != usual)) {
    io.need("model", model);
    model = model.empty() ? usual : model;
  }
}

void site_members(JsonMembers& io, std::optional<Site>& site) {
  io.object_if_any("site", site, [](JsonMembers& one, Site& there) {
    one.need("latitude_deg", there.latitude_deg);
    one.value("longitude_deg", there.longitude_deg);
    one.value("height_m", there.height_m);
  });
  if (site) {
    io.check("site", [&] { check_site(*site); });
  }
}

}  // namespace axiscal
