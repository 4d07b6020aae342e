// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// Adds the kind of field `formula`, so that files can state it: three formulas of the time `t`
/// [s, by the readings' clock; of ISO 8601 times since 1970], for the components in the frame of
/// the table (the usual one: the field is made on it) or in `enu`.
///
///     {"kind": "formula", "unit": "uT", "x": "40 * cos(t / 600)", "y": "40 * sin(t / 600)", "z":
///     "20"}
///
/// A field whose formulas have no `t` stands still. Calling it again changes nothing.
void add_formula_field();

}  // namespace axiscal
