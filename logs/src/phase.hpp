// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace axiscal {

/// The running sum of samples, their mean removed, times 1 / rate: what follows a first phase of 0.
/// @param phase  as many as the samples, which may be the samples themselves.
/// @throws DomainError  where a sample is not finite; nothing is written then.
void put_phase(std::span<const double> samples, double rate_hz, std::span<double> phase);

}  // namespace axiscal
