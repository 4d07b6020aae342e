// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "core/formatted.hpp"
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
              "experiment, laboratory, limits, map, positioner or world; without a name they are "
              "listed",
              Need::optional);
  options.add_output(command.output);
}

struct Template {
  std::string_view name;
  std::string_view (*text)();
  std::string_view help;
};

constexpr std::array<Template, 6> templates = {
    {{"experiment", &experiment_template, "all that is not a reading: calibrate EXPERIMENT.json"},
     {"laboratory", &laboratory_template, "the details of a certificate: report --laboratory"},
     {"limits", &limits_template, "accept or reject: calibrate --limits"},
     {"map", &map_template, "the meaning of a log's columns: --map"},
     {"positioner", &positioner_template, "a measured cube: --positioner"},
     {"world", &world_template, "errors of a simulation: study --world"}}};

int run(const TemplateCommand& command) {
  if (command.name.empty()) {
    std::string text;
    for (const Template& one : templates) {
      text += formatted("{:<12}{}\n", one.name, one.help);
    }
    write_whole_file(command.output,
                     text + "\naxiscal template laboratory -o lab.json writes one\n");
    return 0;
  }
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
