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

/// Binary data of a column, in contrast to text.
struct Bytes {
  std::string_view data;
};

/// A value of an SQL statement: null, an integer, a number, a text or binary data.
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

/// A connection to a database. Statements use only SQL that both SQLite and PostgreSQL accept. The
/// placeholders $1, $2, .. stand for the values. In each statement they first appear in this order.
class Database {
 public:
  using Take = std::function<void(const SqlRow&)>;

  /// The parts of SQL that differ between SQLite and PostgreSQL.
  struct Dialect {
    const char* number_of_row;  ///< type of a key column whose values the database generates
    const char* bytes;          ///< type of a column with binary data
    const char* begin;          ///< statement that begins a transaction for writing
    /// Statement that prevents other processes from creating the schema during a transaction; may
    /// be empty.
    const char* lock_schema;
    const char* has_table;  ///< query that returns a row if the table named by $1 exists
    /// Query that gives a row if the database has tables. A database with tables, but without the
    /// store's table, belongs to another program. In PostgreSQL a store may be among other tables,
    /// so the query never gives a row there.
    const char* has_tables;
  };

  Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  virtual ~Database() = default;

  [[nodiscard]] virtual const Dialect& dialect() const = 0;

  /// Runs one statement.
  /// @param take  is called for each row of the result.
  /// @throws OutputError  if the database is full or unreachable, or refuses the statement.
  virtual void execute(const std::string& sql,
                       std::span<const SqlValue> values = {},
                       const Take& take = {}) = 0;
};

/// Opens an SQLite file.
/// @param may_create  true: a missing file is created.
/// @throws DataError     if the file cannot be opened, or is not a database.
/// @throws RefusedError  if this build lacks SQLite.
[[nodiscard]] std::unique_ptr<Database> open_sqlite(const std::string& path, bool may_create);

/// Connects to PostgreSQL.
/// @throws DataError     if the connection is refused.
/// @throws RefusedError  if this build lacks libpq.
[[nodiscard]] std::unique_ptr<Database> open_postgresql(const std::string& address);

/// @return true if the address is that of a PostgreSQL database: postgresql://..
[[nodiscard]] bool is_postgresql(const std::string& address);

/// @return the address without a password, for messages.
[[nodiscard]] std::string without_password(const std::string& address);

}  // namespace axiscal
