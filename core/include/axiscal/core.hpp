// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/input_protection.hpp"
#include "axiscal/core/kept_memory.hpp"
#include "axiscal/core/median.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/random.hpp"
#include "axiscal/core/rotation.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/version.hpp"

/// @file
/// What every module shares: errors, units, rotations, files in and out, times, random numbers.
///
/// Errors are exceptions that say where and what to do, and their type says whose turn it is:
/// DomainError (an argument is wrong; SetupError, one of them: a set-up lacks something), DataError
/// (a file's content, with path and line), RefusedError (the data do not support an answer),
/// OutputError. Nothing prints, and nothing ends the program.
///
/// @code
/// axiscal::RandomStream random(7, 0);  // a seed and a stream: the same numbers everywhere
/// const Eigen::Vector3d noise(random.normals<3>());
/// const double tilt_rad = 0.5 * axiscal::rad_per_deg;
/// std::printf("%.3f %.6f\n", noise.norm(), tilt_rad);
/// @endcode
///
/// Traps:
/// - A function of the standard library may draw other numbers with another compiler; RandomStream
///   does not.
/// - OutputFile replaces its target only in commit(): what was there stays whole until then.
