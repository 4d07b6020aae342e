// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The files that an experiment file names. They are relative to it, and are read as such.
struct ExperimentPaths {
  std::vector<std::string> observations;
  std::string limits;  ///< the limits for a unit; may be empty
};

/// An experiment with the files that it names.
struct ExperimentFile {
  Experiment experiment;
  ExperimentPaths paths;
};

/// Reads an experiment file (formats.md, Experiment), with the positioner and the record that it
/// names or contains. A file written by experiment_json() is read and written again without a
/// change.
///
/// @param text  the file's content.
/// @param path  its name, for messages and relative paths.
/// @throws DataError  if the text is no such file, has an unknown key (the nearest known one is
///                    suggested), or a value of the wrong type.
[[nodiscard]] AXISCAL_EXPORT ExperimentFile parse_experiment(std::string_view text,
                                                             const std::string& path);

/// As parse_experiment(), from a file.
[[nodiscard]] AXISCAL_EXPORT ExperimentFile read_experiment(const std::string& path);

/// @return true if a file can hold the experiment. It cannot if a part of its fields is a program's
///         class of a kind that was not added by add_field_kind().
[[nodiscard]] AXISCAL_EXPORT bool can_be_stated(const Experiment& experiment);

/// @return the experiment as such a file; a positioner that is not the nominal one and the record
///         that it starts from stand in it whole.
/// @throws DomainError  unless it can_be_stated().
[[nodiscard]] AXISCAL_EXPORT std::string experiment_json(const Experiment& experiment,
                                                         const ExperimentPaths& paths = {});

}  // namespace axiscal
