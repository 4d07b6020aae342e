// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace axiscal {

// Coefficients of the World Magnetic Model 2025: degree and order 12, Schmidt semi-normalised,
// epoch 2025.0. As GeographicLib requires, they are sorted by the order m, then by the degree. The
// sines begin with m = 1.
extern const std::array<double, 91> wmm2025_cosines;       // nT
extern const std::array<double, 78> wmm2025_sines;         // nT
extern const std::array<double, 91> wmm2025_cosine_rates;  // nT per year
extern const std::array<double, 78> wmm2025_sine_rates;    // nT per year

}  // namespace axiscal
