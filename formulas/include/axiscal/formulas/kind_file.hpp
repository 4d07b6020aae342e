// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "axiscal/instruments/instrument_kind.hpp"

namespace axiscal {

/// Adds the kind of instrument that a file describes (formats.md, Instrument kind): its name,
/// derived results of a reading, and the usual parameters of its calibration, by formulas.
///
/// Variables of derived results: x, y, z, the field in the sensor; F, its magnitude; up_x, up_y,
/// up_z, the specific force of an accelerometer in the same frame. Variables of parameters, for
/// each axis: bias, sx, sy, sz, its coefficients; F. The uncertainty follows from the covariance of
/// the coefficients.
///
/// @return the kind as it is known from now on; of a file that was added before, the same.
/// @throws DataError    for a file of another kind, an unknown key or a formula that is none.
/// @throws DomainError  if there is another kind of that name, or the build is without libmuparser.
const InstrumentKind& add_instrument_kind_file(const std::string& path);

}  // namespace axiscal
