// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/formulas/formula_field.hpp"
#include "axiscal/formulas/kind_file.hpp"

/// @file
/// Kinds of instruments and fields that a file defines by formulas, for users who do not write C++.
