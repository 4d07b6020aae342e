// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

/// Adds the kind of instrument that a file describes (formats.md, Instrument kind). The file
/// contains its name, and formulas for the derived results of a reading and for the usual
/// parameters of its calibration.
///
/// Formulas of derived results have these variables: x, y, z (the field in the sensor's frame), F
/// (its magnitude), and up_x, up_y, up_z (the specific force of an accelerometer in that frame).
/// Formulas of parameters have bias, sx, sy, sz (the coefficients of an axis) and F. The
/// uncertainty of a parameter is computed from the covariance of the coefficients.
///
/// @return the added kind. If the file was added before, it is the existing kind.
/// @throws DataError    if the file has another format or an unknown key, a formula is not valid,
///                      or a kind of that name exists already.
const InstrumentKind& add_instrument_kind_file(const std::string& path);

}  // namespace axiscal
