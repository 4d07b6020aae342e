// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "axiscal/core/formatted.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "subcommands.hpp"
#include "templates.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

struct TemplateCommand {
  std::string name;
  std::string output = "-";
};

void add_options(OptionSet& options, TemplateCommand& command) {
  options.add("name", command.name, "NAME",
              "experiment, laboratory, limits, map, positioner or world", Need::required);
  options.add_output(command.output);
}

struct Template {
  std::string_view name;
  std::string_view (*text)();
};

constexpr std::array<Template, 6> templates = {{{"experiment", &experiment_template},
                                                {"laboratory", &laboratory_template},
                                                {"limits", &limits_template},
                                                {"map", &map_template},
                                                {"positioner", &positioner_template},
                                                {"world", &world_template}}};

int run(const TemplateCommand& command) {
  const auto* const found =
      std::find_if(templates.begin(), templates.end(),
                   [&](const Template& one) { return one.name == command.name; });
  if (found == templates.end()) {
    std::vector<std::string_view> names;
    for (const Template& one : templates) {
      names.push_back(one.name);
    }
    throw UsageError(formatted(
        "template: no file is called '{}'{}", command.name,
        did_you_mean(command.name, names,
                     "there are " + joined(std::vector<std::string>(names.begin(), names.end())))));
  }
  write_whole_file(command.output, std::string(found->text()));
  return 0;
}

}  // namespace

Subcommand template_subcommand() {
  return make_subcommand<TemplateCommand>(
      "template", "an example of each file that is written by hand", "", &add_options, &run);
}

}  // namespace axiscal::cli
