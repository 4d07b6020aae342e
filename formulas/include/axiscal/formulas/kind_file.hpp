// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

/// Adds the kind of instrument that a file describes (formats.md, Instrument kind). The file
/// contains the kind's name, formulas for results derived from a reading, and formulas for the
/// parameters that users of this kind expect from a calibration.
///
/// Formulas of derived results have these variables: x, y, z (the field in the sensor's frame), F
/// (its magnitude), and up_x, up_y, up_z (the specific force from an accelerometer, in the same
/// frame). Formulas of parameters have the variables bias, sx, sy, sz (the coefficients of an axis)
/// and F. The uncertainty of a parameter is computed from the covariance of the coefficients.
///
/// @return the added kind, or the existing kind if the file was added before.
/// @throws DataError    if the file has another format or an unknown key, a formula is not valid,
///                      or a kind of that name exists already.
const InstrumentKind& add_instrument_kind_file(const std::string& path);

}  // namespace axiscal
