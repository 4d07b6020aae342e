// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

/// Adds the kind of instrument that a file describes (formats.md, Instrument kind). The file
/// contains its name, and formulas for the derived results of a reading and for the usual
/// parameters of its calibration.
///
/// Variables of derived results: x, y, z, the field in the sensor; F, its magnitude; up_x, up_y,
/// up_z, the specific force of an accelerometer in the same frame. Variables of parameters: bias,
/// sx, sy, sz, the coefficients of an axis; F. The uncertainty of a parameter follows from the
/// covariance of the coefficients.
///
/// @return the added kind. If the file was added before, it is the existing kind.
/// @throws DataError    if the file has another format or an unknown key, a formula is not valid,
///                      or a kind of that name exists already.
const InstrumentKind& add_instrument_kind_file(const std::string& path);

}  // namespace axiscal
