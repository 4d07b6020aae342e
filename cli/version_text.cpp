// SPDX-License-Identifier: Apache-2.0
#include "version_text.hpp"

#include <algorithm>
#include <vector>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <boost/version.hpp>
#include <nlohmann/json.hpp>

#include "axiscal/core/error.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/logs/linked_libraries.hpp"
#include "core/formatted.hpp"
#include "core/own_program.hpp"
#include "logs/recordings/src/other_process.hpp"

namespace axiscal::cli {
namespace {

std::string path_of(const OwnProgram& program) {
  try {
    return own_program(program);
  } catch (const RefusedError&) {
    return formatted("not installed (package {})", program.package);
  }
}

}  // namespace

std::string verbose_version(std::span<const Subcommand> subcommands) {
  std::string text = formatted("{}\n\nLibraries:\n", software_name());
  const auto add = [&](std::string_view name, std::string_view value) {
    text += formatted("  {:<18}{}\n", name, value);
  };
  add("Eigen",
      formatted("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION));
#ifdef AXISCAL_GEOGRAPHICLIB_VERSION
  add("GeographicLib", AXISCAL_GEOGRAPHICLIB_VERSION);
#else
  add("GeographicLib", "absent: no models of the Earth's fields");
#endif
  add("nlohmann-json", formatted("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR,
                                 NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH));
  add("Boost", formatted("{}.{}.{}", BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000,
                         BOOST_VERSION % 100));
  add("CLI11", CLI11_VERSION);
  for (const LinkedLibrary& library : linked_libraries()) {
    add(library.name, library.version.empty()
                          ? formatted("absent: cannot read {}", library.reads)
                          : formatted("{:<9} reads {}", library.version, library.reads));
  }
  std::vector<OwnProgram> programs = {reader_program};
  for (const Subcommand& subcommand : subcommands) {
    const bool is_listed = std::any_of(
        programs.begin(), programs.end(),
        [&](const OwnProgram& program) { return program.name == subcommand.program.name; });
    if (subcommand.program.name != nullptr && !is_listed) {
      programs.push_back(subcommand.program);
    }
  }
  text += "\nPrograms:\n";
  for (const OwnProgram& program : programs) {
    add(program.name, path_of(program));
  }
  return text;
}

}  // namespace axiscal::cli
