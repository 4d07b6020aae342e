// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/formulas/formula_field.hpp"
#include "axiscal/formulas/kind_file.hpp"

/// @file
/// Lets users define kinds of instruments and fields by formulas in a file, without writing C++.
