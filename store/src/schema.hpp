// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "store/src/database.hpp"

namespace axiscal {

/// @return the version of the schema after migrate_schema().
[[nodiscard]] int newest_schema();

/// @return the version of the schema; 0 if the database does not contain a store yet.
/// @param name  name of the database, for messages.
/// @throws DataError  if the database belongs to another program.
[[nodiscard]] int schema_of(Database& database, const std::string& name);

/// Updates the schema to newest_schema(), in one transaction.
void migrate_schema(Database& database);

}  // namespace axiscal
