// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace axiscal {

/// Bytes of a column that are no text.
struct Bytes {
  std::string_view data;
};

/// A value of a statement; null, a whole number, a number, a text or bytes.
using SqlValue = std::variant<std::monostate, std::int64_t, double, std::string_view, Bytes>;

/// A row of a result. The columns are counted from 0.
class SqlRow {
 public:
  SqlRow() = default;
  SqlRow(const SqlRow&) = delete;
  SqlRow& operator=(const SqlRow&) = delete;
  virtual ~SqlRow() = default;

  [[nodiscard]] virtual bool is_null(int column) const = 0;
  [[nodiscard]] virtual std::int64_t integer(int column) const = 0;
  [[nodiscard]] virtual double number(int column) const = 0;  ///< NaN for null
  [[nodiscard]] virtual std::string text(int column) const = 0;
  [[nodiscard]] virtual std::string bytes(int column) const = 0;
};

/// A connection to a database. SQL is the common part of SQLite's and PostgreSQL's; values are $1,
/// $2, .., in the order in which they first appear.
class Database {
 public:
  using Take = std::function<void(const SqlRow&)>;

  /// The words that differ.
  struct Dialect {
    const char* number_of_row;  ///< type of a key that the database numbers
    const char* bytes;          ///< type of bytes
    const char* begin;          ///< begins a transaction that writes
    const char* lock_schema;    ///< within it: no other process makes the schema; may be empty
    const char* has_table;      ///< gives a row if the table $1 exists
    /// For a database without the store's table: gives a row if it has other tables, so that it
    /// belongs to another program. In PostgreSQL, where a store may lie among other tables, it
    /// never gives a row.
    const char* has_tables;
  };

  Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  virtual ~Database() = default;

  [[nodiscard]] virtual const Dialect& dialect() const = 0;

  /// Runs one statement.
  /// @param take  gets the rows of its result, one by one.
  /// @throws OutputError  if the database is full or unreachable, or refuses the statement.
  virtual void execute(const std::string& sql,
                       std::span<const SqlValue> values = {},
                       const Take& take = {}) = 0;
};

/// Opens a file of SQLite.
/// @param may_create  a missing file is made; else it is an error.
/// @throws DataError     if there is no such file, or it is not a database.
/// @throws RefusedError  if this build lacks SQLite.
[[nodiscard]] std::unique_ptr<Database> open_sqlite(const std::string& path, bool may_create);

/// Connects to PostgreSQL.
/// @throws DataError     if the connection is refused.
/// @throws RefusedError  if this build lacks libpq.
[[nodiscard]] std::unique_ptr<Database> open_postgresql(const std::string& address);

/// @return true if the address is one of PostgreSQL.
[[nodiscard]] bool is_postgresql(const std::string& address);

/// @return the address without a password, for messages.
[[nodiscard]] std::string without_password(const std::string& address);

}  // namespace axiscal
