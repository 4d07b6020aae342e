// SPDX-License-Identifier: Apache-2.0
#include "option_names.hpp"

#include <string_view>
#include <vector>

#include "axiscal/core/number_text.hpp"

namespace axiscal::cli {
namespace {

// The compiler names a setting that has no option here.
std::string_view option_of(Setting setting) {
  switch (setting) {
    case Setting::axes:
      return "--axes";
    case Setting::column_names:
      return "--map";
    case Setting::date:
      return "--date";
    case Setting::fence_azimuth:
      return "--fence-azimuth";
    case Setting::field:
      return "--field";
    case Setting::field_magnitude:
      return "--field-magnitude";
    case Setting::field_magnitude_u:
      return "--field-magnitude-u";
    case Setting::field_table:
      return "--field-table";
    case Setting::from_record:
      return "--from";
    case Setting::gyroscope_scale:
      return "--gyroscope-scale";
    case Setting::instrument:
      return "--instrument";
    case Setting::imported_magnitude:
      return "--magnitude";
    case Setting::journal:
      return "--journal";
    case Setting::laboratory:
      return "--laboratory";
    case Setting::leave_out:
      return "--leave-out";
    case Setting::local_gravity:
      return "--gravity";
    case Setting::log:
      return "calibrate --imu";
    case Setting::longitude:
      return "--longitude";
    case Setting::lossy:
      return "--lossy";
    case Setting::magnetic_model:
      return "--magnetic-model";
    case Setting::method:
      return "--method";
    case Setting::numbers:
      return "--numbers";
    case Setting::plain_face:
      return "--plain";
    case Setting::polar_fit:
      return "--polar-fit";
    case Setting::ports:
      return "acquire --list";
    case Setting::range:
      return "--range";
    case Setting::rate:
      return "--rate";
    case Setting::reading_factor:
      return "--reading-factor";
    case Setting::resume:
      return "--resume";
    case Setting::run_sheet:
      return "--plan";
    case Setting::shortest_rest:
      return "--min-length";
    case Setting::site:
      return "--latitude, --longitude";
    case Setting::slope:
      return "--slope";
    case Setting::temperature_order:
      return "--temperature-order";
    case Setting::time_column:
      return "--time";
    case Setting::web_face:
      return "--web";
  }
  return "";
}

}  // namespace

std::string with_options(const Error& error) {
  std::vector<std::string> options;
  for (const Setting setting : error.settings()) {
    options.emplace_back(option_of(setting));
  }
  return error.what() + (options.empty() ? "" : " (" + joined(options) + ")");
}

}  // namespace axiscal::cli
