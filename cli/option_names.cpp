// SPDX-License-Identifier: Apache-2.0
#include "option_names.hpp"

#include <array>
#include <string_view>
#include <vector>

#include "axiscal/calib/settings.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/exchange/settings.hpp"
#include "axiscal/field/settings.hpp"
#include "axiscal/instruments/settings.hpp"
#include "axiscal/logs/settings.hpp"
#ifdef AXISCAL_ACQUISITION
#include "axiscal/acquisition/settings.hpp"
#endif

namespace axiscal::cli {
namespace {

struct OptionName {
  Setting setting;
  std::string_view option;
};

constexpr std::array options_of_settings = {
#ifdef AXISCAL_ACQUISITION
    OptionName{settings::journal, "--journal"},
    OptionName{settings::plain_face, "--plain"},
    OptionName{settings::ports, "acquire --list"},
    OptionName{settings::resume, "--resume"},
    OptionName{settings::web_face, "--web"},
#endif
    OptionName{settings::axes, "--axes"},
    OptionName{settings::column_names, "--map"},
    OptionName{settings::date, "--date"},
    OptionName{settings::each, "--each"},
    OptionName{settings::fence_azimuth, "--fence-azimuth"},
    OptionName{settings::field, "--field"},
    OptionName{settings::field_magnitude, "--field-magnitude"},
    OptionName{settings::field_magnitude_u, "--field-magnitude-u"},
    OptionName{settings::field_table, "--field-table"},
    OptionName{settings::from_record, "--from"},
    OptionName{settings::gyroscope_scale, "--gyroscope-scale"},
    OptionName{settings::instrument, "--instrument"},
    OptionName{settings::imported_magnitude, "--magnitude"},
    OptionName{settings::laboratory, "--laboratory"},
    OptionName{settings::leave_out, "--leave-out"},
    OptionName{settings::local_gravity, "--gravity"},
    OptionName{settings::log, "calibrate --imu"},
    OptionName{settings::longitude, "--longitude"},
    OptionName{settings::lossy, "--lossy"},
    OptionName{settings::magnetic_model, "--magnetic-model"},
    OptionName{settings::method, "--method"},
    OptionName{settings::numbers, "--numbers"},
    OptionName{settings::polar_fit, "--polar-fit"},
    OptionName{settings::range, "--range"},
    OptionName{settings::rate, "--rate"},
    OptionName{settings::read_limit, "--limit NAME=VALUE"},
    OptionName{settings::reading_factor, "--reading-factor"},
    OptionName{settings::run_sheet, "--plan"},
    OptionName{settings::serial, "--serial"},
    OptionName{settings::shortest_rest, "--min-length"},
    OptionName{settings::site, "--latitude, --longitude"},
    OptionName{settings::slope, "--slope"},
    OptionName{settings::temperature_order, "--temperature-order"},
    OptionName{settings::time_column, "--time"}};

// Returns the name of the option for a setting. If no option sets it, returns the path of the
// setting.
std::string_view option_of(Setting setting) {
  for (const OptionName& one : options_of_settings) {
    if (one.setting == setting) {
      return one.option;
    }
  }
  return setting.path;
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
