// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib.hpp"
#include "axiscal/core.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/field.hpp"
#include "axiscal/instruments.hpp"
#include "axiscal/positioner.hpp"

/// @file
/// The core of the library: fields, cubes, instruments, calibrations and the reduction of readings.
///
/// Each module has a header with a description, a short program and common mistakes. This header
/// includes axiscal/core.hpp, field.hpp, positioner.hpp, instruments.hpp and calib.hpp. A build may
/// lack the other modules, so logs.hpp, exchange.hpp, report.hpp and acquisition.hpp are not
/// included.
