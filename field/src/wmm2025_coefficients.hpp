// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace axiscal {

// The World Magnetic Model 2025 in GeographicLib's order: degree and order 12, Schmidt
// semi-normalised, column by column (order m), the sines from m = 1. Epoch 2025.0.
extern const std::array<double, 91> wmm2025_cosines;       // nT
extern const std::array<double, 78> wmm2025_sines;         // nT
extern const std::array<double, 91> wmm2025_cosine_rates;  // nT per year
extern const std::array<double, 78> wmm2025_sine_rates;    // nT per year

}  // namespace axiscal
