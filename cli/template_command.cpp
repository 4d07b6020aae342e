// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

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
  bool json = false;
};

void add_options(OptionSet& options, TemplateCommand& command) {
  options.add(
      "name", command.name, "NAME",
      "experiment, laboratory, limits, map, positioner or world; without a name all are listed",
      Need::optional);
  options.add_flag("--json", command.json, "print the list of templates as JSON");
  options.add_output(command.output);
}

struct Template {
  std::string_view name;
  std::string_view (*text)();
  std::string_view help;
};

constexpr std::array<Template, 6> templates = {
    {{"experiment", &experiment_template,
      "settings of an experiment, for `calibrate EXPERIMENT.json`"},
     {"laboratory", &laboratory_template, "details of a certificate, for `report --laboratory`"},
     {"limits", &limits_template, "limits for accepting a unit, for `calibrate --limits`"},
     {"map", &map_template, "meaning of a log's columns, for the option --map"},
     {"positioner", &positioner_template, "a measured cube, for the option --positioner"},
     {"world", &world_template, "errors of a simulation, for `study --world`"}}};

std::string list_of_templates() {
  std::string text;
  for (const Template& one : templates) {
    text += formatted("{:<12}{}\n", one.name, one.help);
  }
  return text + "\n`axiscal template laboratory -o lab.json` writes the template to a file\n";
}

std::string templates_json() {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Template& one : templates) {
    list.push_back({{"name", one.name}, {"description", one.help}});
  }
  return list.dump(2) + "\n";
}

int run(const TemplateCommand& command) {
  if (command.name.empty()) {
    write_whole_file(command.output, command.json ? templates_json() : list_of_templates());
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
        "template: unknown template '{}'{}", command.name,
        did_you_mean(
            command.name, names,
            "the templates are " + joined(std::vector<std::string>(names.begin(), names.end())))));
  }
  write_whole_file(command.output, std::string(found->text()));
  return 0;
}

}  // namespace

Subcommand template_subcommand() {
  return make_subcommand<TemplateCommand>(
      "template", "print an example of a file that is written by hand", "", &add_options, &run);
}

}  // namespace axiscal::cli
