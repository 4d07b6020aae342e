// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace axiscal {

/// The running sum of samples without their mean, times 1 / rate: the phase after a first phase of
/// 0.
/// @param phase  as many as the samples, which may be the samples themselves.
/// @throws DomainError  if a sample is not finite; the output then stays unchanged.
void put_phase(std::span<const double> samples, double rate_hz, std::span<double> phase);

}  // namespace axiscal
