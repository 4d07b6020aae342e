#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Converts field/data/wmm-2025.json to GeographicLib's model files and to a C++ source with the coefficients.

    scripts/make_wmm.py [FOLDER]    writes field/data and field/src in FOLDER (default: this repository)

GeographicLib stores the coefficients by columns: m = 0 with n = 0..N, then m = 1 with n = 1..N, and so on. The sine
coefficients start at m = 1 (GeographicLib's documentation, "The format of the magnetic model files").
"""
import json
import pathlib
import struct
import sys

HOME = pathlib.Path(__file__).resolve().parent.parent
SOURCE = HOME / "field/data/wmm-2025.json"

DESCRIPTION = """WMMF-1
# Made by scripts/make_wmm.py from the numbers of NOAA's WMM.COF; see SOURCE.md.
Name wmm2025
Description World Magnetic Model 2025
URL https://www.ncei.noaa.gov/products/world-magnetic-model
Publisher National Oceanic and Atmospheric Administration
ReleaseDate 2024-11-13
Radius 6371200
NumModels 1
Epoch 2025
DeltaEpoch 1
MinTime 2025
MaxTime 2030
MinHeight -1000
MaxHeight 850000
Type linear
Normalization schmidt
ByteOrder little
ID WMM2025A
"""


def by_columns(values, degree, first_order):
    """Returns the coefficients in GeographicLib's order, by columns. `values` has them by rows."""
    return [values[n * (n + 1) // 2 + m]
            for m in range(first_order, degree + 1) for n in range(m, degree + 1)]


def sets_of(model):
    for g, h in (("main_field_coeff_g", "main_field_coeff_h"),
                 ("secular_var_coeff_g", "secular_var_coeff_h")):
        degree = model["n_max"]
        yield degree, by_columns(model[g], degree, 0), by_columns(model[h], degree, 1)


def binary(model):
    data = b"WMM2025A"
    for degree, cosines, sines in sets_of(model):
        data += struct.pack("<2i", degree, degree)
        data += struct.pack(f"<{len(cosines) + len(sines)}d", *cosines, *sines)
    return data


def array(name, values):
    lines, line = [], "   "
    for value in values:
        cell = f" {value!r},"
        if len(line) + len(cell) > 100:
            lines.append(line)
            line = "   "
        line += cell
    lines.append(line)
    body = "\n".join(lines)
    return f"const std::array<double, {len(values)}> {name} = {{\n{body}\n}};\n"


def source(model):
    names = (("wmm2025_cosines", "wmm2025_sines"), ("wmm2025_cosine_rates", "wmm2025_sine_rates"))
    text = """// SPDX-License-Identifier: Apache-2.0
// Made by scripts/make_wmm.py from field/data/wmm-2025.json; do not edit.
// clang-format off
#include "field/src/wmm2025_coefficients.hpp"

namespace axiscal {

"""
    for (cosine_name, sine_name), (_, cosines, sines) in zip(names, sets_of(model)):
        text += array(cosine_name, cosines) + "\n" + array(sine_name, sines) + "\n"
    return text + "}  // namespace axiscal\n"


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HOME
    model = json.loads(SOURCE.read_text())
    (folder / "field/data").mkdir(parents=True, exist_ok=True)
    (folder / "field/src").mkdir(parents=True, exist_ok=True)
    (folder / "field/data/wmm2025.wmm").write_text(DESCRIPTION)
    (folder / "field/data/wmm2025.wmm.cof").write_bytes(binary(model))
    (folder / "field/src/wmm2025_coefficients.cpp").write_text(source(model))


main()
