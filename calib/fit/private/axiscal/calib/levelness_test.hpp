// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "axiscal/calib/estimation.hpp"

namespace axiscal {

/// Whether the slope of the table by one rest face agrees with what all other readings say: the
/// differences of its opposite positions against their prediction, each axis by its own scatter
/// (method.md, section 5). Puts the probability, and the face that disagrees, into the estimate's
/// levelness; nothing where it has none.
///
/// @param set          the readings that were fitted.
/// @param known_field  whether the field's direction was given.
void test_levelness(const ReadingSet& set, bool known_field, Estimate& estimate);

}  // namespace axiscal
