// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace axiscal {

/// Adds the kind of field `formula`, so that files can state it. Each of its three components is a
/// formula of the time `t` [s]. `t` is by the readings' clock; ISO 8601 times count from 1970. By
/// default the components are in the table's frame, and the field is an induced field. With the
/// frame `enu` it is a local field.
///
///     {"kind": "formula", "unit": "uT", "x": "40 * cos(t / 600)", "y": "40 * sin(t / 600)", "z":
///     "20"}
///
/// A field whose formulas do not contain `t` is constant. A second call has no effect.
void add_formula_field();

}  // namespace axiscal
