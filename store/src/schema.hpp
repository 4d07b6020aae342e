// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "store/src/database.hpp"

namespace axiscal {

/// The version that migrate_schema() makes.
[[nodiscard]] int newest_schema();

/// @return the version of the schema; 0 if the database has no tables.
/// @param name  of the database, for messages.
/// @throws DataError  if the database belongs to another program.
[[nodiscard]] int schema_of(Database& database, const std::string& name);

/// Brings the schema from a version to newest_schema(), in one transaction.
void migrate_schema(Database& database);

}  // namespace axiscal
