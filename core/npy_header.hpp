// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace axiscal {

/// The header of a file in NumPy's format 1.0; little-endian.
///
/// @param type        as a Python literal: `'<f8'`, or a list of names and types.
/// @param shape       as a Python tuple; of whatever length, the header of a type is as long.
/// @param by_columns  whether the numbers go column by column.
/// @par Source
/// numpy.lib.format, NEP 1.
[[nodiscard]] std::string npy_header(const std::string& type,
                                     const std::string& shape,
                                     bool by_columns = false);

}  // namespace axiscal
