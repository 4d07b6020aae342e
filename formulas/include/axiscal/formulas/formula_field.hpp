// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// Adds the kind of field `formula`, so that files can state it. Each component of such a field is
/// a formula of the time `t` [s] of a reading. If the readings have ISO 8601 times, `t` counts from
/// 1970. By default the components are in the table's frame, and the field is induced. With
/// `"frame": "enu"` it is a local field.
///
///     {"kind": "formula", "unit": "uT", "x": "40 * cos(t / 600)", "y": "40 * sin(t / 600)", "z":
///     "20"}
///
/// A field whose formulas do not contain `t` is constant. A second call has no effect.
void add_formula_field();

}  // namespace axiscal
