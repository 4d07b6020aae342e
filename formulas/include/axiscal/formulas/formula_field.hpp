// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// Adds the kind of field `formula`, so that files can state it. It has three formulas of the time
/// `t` for its components. `t` is in seconds by the readings' clock; ISO 8601 times count from
/// 1970. The components are in the table's frame by default: then the field is made on the table.
/// With the frame `enu` it is a local field.
///
///     {"kind": "formula", "unit": "uT", "x": "40 * cos(t / 600)", "y": "40 * sin(t / 600)", "z":
///     "20"}
///
/// A field whose formulas do not contain `t` is constant. A second call has no effect.
void add_formula_field();

}  // namespace axiscal
