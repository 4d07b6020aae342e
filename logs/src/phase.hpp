// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace axiscal {

/// The running sum of samples, their mean removed, times 1 / rate.
/// @param phase  one more than the samples are written there.
/// @throws DomainError  where a sample is not finite.
void put_phase(std::span<const double> samples, double rate_hz, double* phase);

}  // namespace axiscal
