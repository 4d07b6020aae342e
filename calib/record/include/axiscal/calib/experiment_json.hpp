// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "axiscal/calib/experiment.hpp"

namespace axiscal {

/// Reads an experiment file (formats.md, Experiment), with the positioner file that it names.
///
/// Paths in it are relative to it.
///
/// @param text  the file's content.
/// @param path  its name, for messages and relative paths.
/// @throws DataError  if the text is no such file, has an unknown key (the nearest known one is
///                    suggested), a value of the wrong type, or one that this version cannot use.
[[nodiscard]] Experiment parse_experiment(std::string_view text, const std::string& path);

/// As parse_experiment(), from a file.
[[nodiscard]] Experiment read_experiment(const std::string& path);

}  // namespace axiscal
