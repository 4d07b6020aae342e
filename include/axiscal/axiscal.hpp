// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib.hpp"
#include "axiscal/core.hpp"
#include "axiscal/core/version.hpp"
#include "axiscal/field.hpp"
#include "axiscal/instruments.hpp"
#include "axiscal/positioner.hpp"

/// @file
/// The library proper: from a field and a cube to a calibration, and to angles.
///
/// Each module has a header with a description, a short program and its traps. This header includes
/// axiscal/core.hpp, field.hpp, positioner.hpp, instruments.hpp and calib.hpp. A build may lack
/// logs.hpp, exchange.hpp, report.hpp and acquisition.hpp.
