// SPDX-License-Identifier: Apache-2.0
#include "store/src/schema.hpp"

#include <array>
#include <cstddef>
#include <vector>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Returns the statements that update the schema: element i updates version i to version i + 1. Do
// not change these elements, because existing stores were made with them. Append one for each new
// version.
std::vector<std::vector<std::string>> steps(const Database::Dialect& dialect) {
  return {
      {"CREATE TABLE axiscal_store (version INTEGER NOT NULL)",
       "INSERT INTO axiscal_store (version) VALUES (0)",
       formatted("CREATE TABLE axiscal_calibration ("
                 "id {}, serial TEXT NOT NULL, slot TEXT NOT NULL, model TEXT NOT NULL, "
                 "kind TEXT NOT NULL, unit TEXT NOT NULL, date TEXT NOT NULL, "
                 "measured TEXT NOT NULL, computed TEXT NOT NULL, status TEXT NOT NULL, "
                 "passed INTEGER, reason TEXT NOT NULL, limits TEXT NOT NULL, "
                 "station TEXT NOT NULL, operator TEXT NOT NULL, batch TEXT NOT NULL, "
                 "inputs TEXT NOT NULL, digest TEXT NOT NULL, UNIQUE (serial, digest))",
                 dialect.number_of_row),
       "CREATE TABLE axiscal_coefficient ("
       "calibration BIGINT NOT NULL REFERENCES axiscal_calibration (id), place INTEGER NOT NULL, "
       "name TEXT NOT NULL, value DOUBLE PRECISION, u DOUBLE PRECISION, "
       "u_noise DOUBLE PRECISION, expanded DOUBLE PRECISION, PRIMARY KEY (calibration, place))",
       formatted("CREATE TABLE axiscal_record ("
                 "calibration BIGINT PRIMARY KEY REFERENCES axiscal_calibration (id), "
                 "json {} NOT NULL)",
                 dialect.bytes),
       "CREATE INDEX axiscal_by_unit ON axiscal_calibration (serial, date)"},
      // With this index, a million units are counted by result without reading their rows.
      {"CREATE INDEX axiscal_by_result ON axiscal_calibration (kind, model, status, passed, "
       "reason)"}};
}

}  // namespace

int newest_schema() {
  return 2;
}

int schema_of(Database& database, const std::string& name) {
  // Another process may create the store between the two queries. The tables of other programs are
  // therefore looked for first.
  bool is_used = false;
  database.execute(database.dialect().has_tables, {}, [&](const SqlRow&) { is_used = true; });
  bool is_store = false;
  database.execute(database.dialect().has_table, std::array<SqlValue, 1>{"axiscal_store"},
                   [&](const SqlRow&) { is_store = true; });
  if (!is_store) {
    if (is_used) {
      throw DataError(name, "is not a store: it is another program's database");
    }
    return 0;
  }
  std::int64_t version = -1;
  database.execute("SELECT version FROM axiscal_store", {},
                   [&](const SqlRow& row) { version = row.integer(0); });
  if (version < 0) {
    throw DataError(name, "is not a store: its table axiscal_store is empty");
  }
  return static_cast<int>(version);
}

void migrate_schema(Database& database) {
  database.execute(database.dialect().begin);
  if (*database.dialect().lock_schema != '\0') {
    database.execute(database.dialect().lock_schema);
  }
  const int version = schema_of(database, "");  // read again: another process may have updated it
  const auto all = steps(database.dialect());
  for (auto step = static_cast<std::size_t>(version); step < all.size(); ++step) {
    for (const std::string& statement : all[step]) {
      database.execute(statement);
    }
  }
  database.execute("UPDATE axiscal_store SET version = $1",
                   std::array<SqlValue, 1>{std::int64_t{newest_schema()}});
  database.execute("COMMIT");
}

}  // namespace axiscal
