// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace axiscal {

/// Subtracts the mean from the samples, and computes their running sum divided by the rate. The
/// result is the phase after each sample; the phase before the first sample is 0.
/// @param phase  receives one phase for each sample; it may be `samples` itself.
/// @throws DomainError  if a sample is not finite; the output then stays unchanged.
void put_phase(std::span<const double> samples, double rate_hz, std::span<double> phase);

}  // namespace axiscal
