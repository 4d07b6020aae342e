// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "commands.hpp"
#include "templates.hpp"

namespace axiscal::cli {
namespace {

struct Template {
  std::string_view name;
  std::string_view (*text)();
};

constexpr std::array<Template, 5> templates = {{{"experiment", &experiment_template},
                                                {"laboratory", &laboratory_template},
                                                {"limits", &limits_template},
                                                {"map", &map_template},
                                                {"positioner", &positioner_template}}};

}  // namespace

int run(const TemplateCommand& command) {
  const auto* const found =
      std::find_if(templates.begin(), templates.end(),
                   [&](const Template& one) { return one.name == command.name; });
  if (found == templates.end()) {
    std::vector<std::string_view> names;
    for (const Template& one : templates) {
      names.push_back(one.name);
    }
    throw UsageError("template: no file is called '" + command.name + "'" +
                     did_you_mean(command.name, names) + "; there are " +
                     joined(std::vector<std::string>(names.begin(), names.end())));
  }
  write_whole_file(command.output, std::string(found->text()));
  return 0;
}

}  // namespace axiscal::cli
