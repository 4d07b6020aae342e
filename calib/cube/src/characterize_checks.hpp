// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axiscal/calib/characterize.hpp"
#include "calib/cube/src/solid_fit.hpp"

namespace axiscal {

/// @throws DomainError   if a slot lacks a name, if two slots have one name, or if the readings of
///                       a reference have another number of axes than its record.
/// @throws RefusedError  if a reference cannot measure a cube. It needs three axes or more, a field
///                       along the table's normal, and a design point for each reading.
void check_references(const std::vector<Reference>& references);

/// @throws RefusedError  if a face was never the rest face, because its normal is then
///                       undetermined.
void require_faces(const std::vector<SolidReference>& references);

/// Requires that each slope has readings at two design points with the same rest face and opposite
/// fence faces. Only such readings separate the slope from the face normals.
/// @throws RefusedError  if there is no such pair.
void require_opposites(const SolidReference& reference);

}  // namespace axiscal
