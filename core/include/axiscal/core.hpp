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
/// Facilities for all modules: errors, units, rotations, input and output files, times, random
/// numbers.
///
/// Errors are exceptions. The message of an error states the place and the remedy. The types are:
/// DomainError (a wrong argument), its subclass SetupError (an incomplete set-up), DataError (a
/// fault in a file, with path and line), RefusedError (no result can be computed from the data)
/// and OutputError (a result cannot be stored). The library does not print and does not end the
/// program.
///
/// @code
/// axiscal::RandomStream random(7, 0);  // seed and stream; same numbers on each machine
/// const Eigen::Vector3d noise(random.normals<3>());
/// const double tilt_rad = 0.5 * axiscal::rad_per_deg;
/// std::printf("%.3f %.6f\n", noise.norm(), tilt_rad);
/// @endcode
///
/// Traps:
/// - The standard library's distributions draw different numbers with different compilers;
///   RandomStream draws the same numbers with each compiler.
/// - OutputFile replaces its target only in commit(). Until then the old file does not change.
