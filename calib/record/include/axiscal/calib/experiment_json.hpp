// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The paths of other files in an experiment file. parse_experiment() resolves relative paths from
/// the folder of the experiment file.
struct ExperimentPaths {
  std::vector<std::string> observations;
  std::string limits;  ///< path of the limits file; may be empty
};

/// An experiment, and the paths of other files in its file.
struct ExperimentFile {
  Experiment experiment;
  ExperimentPaths paths;
};

/// Reads an experiment file (formats.md, Experiment). The positioner and the record `from` may be
/// members of the file or separate files. If experiment_json() wrote the text, experiment_json() of
/// the result gives the same text again.
///
/// @param text  the file's content.
/// @param path  the file's path, for messages and for relative paths.
/// @throws DataError  if the text is not an experiment file, has an unknown key (the message
///                    suggests the nearest known key), or has a value of the wrong type.
[[nodiscard]] AXISCAL_EXPORT ExperimentFile parse_experiment(std::string_view text,
                                                             const std::string& path);

/// Reads an experiment file from a path with parse_experiment().
[[nodiscard]] AXISCAL_EXPORT ExperimentFile read_experiment(const std::string& path);

/// @return true if an experiment file can contain the experiment. It cannot if the field is of a
///         user-defined class whose kind was not registered by add_field_kind().
[[nodiscard]] AXISCAL_EXPORT bool can_be_stated(const Experiment& experiment);

/// @return the text of an experiment file. It contains the whole record Experiment::from, and the
///         whole positioner unless that is the nominal cube.
/// @throws DomainError  unless can_be_stated() is true.
[[nodiscard]] AXISCAL_EXPORT std::string experiment_json(const Experiment& experiment,
                                                         const ExperimentPaths& paths = {});

}  // namespace axiscal
