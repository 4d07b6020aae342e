// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// Adds the kind of field `formula`, so that files can state it: three formulas of the time `t` [s,
/// by the readings' clock; ISO 8601 times count from 1970], for the components in the table's frame
/// (default: the table produces the field) or in `enu`.
///
///     {"kind": "formula", "unit": "uT", "x": "40 * cos(t / 600)", "y": "40 * sin(t / 600)", "z":
///     "20"}
///
/// A field whose formulas have no `t` stands still. Calling it again changes nothing.
void add_formula_field();

}  // namespace axiscal
