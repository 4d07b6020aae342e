// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/estimation.hpp"

namespace axiscal {

/// Whether soaks lie on the polynomials over temperature, as repeats of whole designs say without a
/// repeat at one temperature: each soak has a bias and a scale of its own beside the polynomials,
/// an F test of nested models for each axis. Where they do not, what the soaks scatter about the
/// curves is a component "soaks" of the covariance, with L - order - 1 degrees of freedom.
///
/// @param set       the readings that were fitted, over soaks.
/// @param estimate  lack_of_fit without repeats is filled; statistics, intervals and components
///                  count the soaks' scatter.
/// @par Source
/// method.md, section 6.
void add_soak_scatter(const ReadingSet& set, Estimate& estimate);

}  // namespace axiscal
