// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace axiscal {

/// Returns the header of a .npy file (format version 1.0) for an array of little-endian numbers.
///
/// @param type        the numbers' type as a Python literal: `'<f8'`, or a list of names and types.
/// @param shape       the array's shape as a Python tuple. The header's length is the same for all
///                    shapes of up to 46 characters.
/// @param by_columns  true if the numbers are in column-major (Fortran) order.
/// @par Source
/// numpy.lib.format, NEP 1.
[[nodiscard]] std::string npy_header(const std::string& type,
                                     const std::string& shape,
                                     bool by_columns = false);

}  // namespace axiscal
