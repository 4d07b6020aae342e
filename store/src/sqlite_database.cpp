// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/error.hpp"
#include "store/src/database.hpp"

#ifdef AXISCAL_SQLITE
#include <filesystem>
#include <limits>
#include <map>
#include <sqlite3.h>
#endif

namespace axiscal {

#ifdef AXISCAL_SQLITE
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;

class SqliteRow final : public SqlRow {
 public:
  explicit SqliteRow(sqlite3_stmt* statement) : statement_(statement) {}

  bool is_null(int column) const override {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
  }
  std::int64_t integer(int column) const override {
    return sqlite3_column_int64(statement_, column);
  }
  double number(int column) const override {
    return is_null(column) ? std::numeric_limits<double>::quiet_NaN()
                           : sqlite3_column_double(statement_, column);
  }
  std::string text(int column) const override { return bytes(column); }
  std::string bytes(int column) const override {
    const auto* const data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    const int size = sqlite3_column_bytes(statement_, column);
    return data == nullptr ? std::string() : std::string(data, static_cast<std::size_t>(size));
  }

 private:
  sqlite3_stmt* statement_;
};

class SqliteDatabase final : public Database {
 public:
  SqliteDatabase(const std::string& path, bool may_create) : path_(path) {
    if (!may_create && !std::filesystem::exists(path)) {
      throw DataError(path, "no such store");
    }
    const int flags = SQLITE_OPEN_READWRITE | (may_create ? SQLITE_OPEN_CREATE : 0);
    sqlite3* database = nullptr;
    const int status = sqlite3_open_v2(path.c_str(), &database, flags, nullptr);
    database_.reset(database);
    if (status != SQLITE_OK) {
      throw DataError(path, std::string("cannot be opened: ") + sqlite3_errmsg(database));
    }
    // If another process has locked the database for writing, SQLite waits for at most this time.
    constexpr int patience_ms = 60000;
    sqlite3_busy_timeout(database, patience_ms);
    sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    for (const char* const setting :
         {"PRAGMA cell_size_check=ON", "PRAGMA foreign_keys=ON", "PRAGMA synchronous=NORMAL"}) {
      sqlite3_exec(database, setting, nullptr, nullptr, nullptr);
    }
    if (sqlite3_exec(database, "SELECT count(*) FROM sqlite_master", nullptr, nullptr, nullptr) ==
        SQLITE_NOTADB) {
      throw DataError(path, "is not a store: SQLite cannot open it");
    }
    if (may_create) {  // with WAL, readers and one writer do not wait for each other
      sqlite3_exec(database, "PRAGMA journal_mode=WAL", nullptr, nullptr, nullptr);
    }
  }

  const Dialect& dialect() const override {
    static constexpr Dialect sqlite = {
        .number_of_row = "INTEGER PRIMARY KEY",
        .bytes = "BLOB",
        .begin = "BEGIN IMMEDIATE",
        .lock_schema = "",
        .has_table = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = $1",
        .has_tables = "SELECT 1 FROM sqlite_master WHERE type = 'table' LIMIT 1"};
    return sqlite;
  }

  void execute(const std::string& sql,
               std::span<const SqlValue> values,
               const Take& take) override {
    sqlite3_stmt* const statement = prepared(sql);
    for (std::size_t i = 0; i < values.size(); ++i) {
      bind(statement, static_cast<int>(i) + 1, values[i]);
    }
    int status = sqlite3_step(statement);
    while (status == SQLITE_ROW) {
      if (take) {
        take(SqliteRow(statement));
      }
      status = sqlite3_step(statement);
    }
    sqlite3_reset(statement);
    sqlite3_clear_bindings(statement);
    if (status != SQLITE_DONE) {
      fail(status);
    }
  }

 private:
  sqlite3_stmt* prepared(const std::string& sql) {
    Statement& statement = statements_[sql];
    if (statement == nullptr) {
      sqlite3_stmt* made = nullptr;
      const int status = sqlite3_prepare_v2(database_.get(), sql.c_str(),
                                            static_cast<int>(sql.size()), &made, nullptr);
      statement.reset(made);
      if (status != SQLITE_OK) {
        statements_.erase(sql);
        fail(status);
      }
    }
    return statement.get();
  }

  static void bind(sqlite3_stmt* statement, int place, const SqlValue& value) {
    if (const auto* const integer = std::get_if<std::int64_t>(&value)) {
      sqlite3_bind_int64(statement, place, *integer);
    } else if (const auto* const number = std::get_if<double>(&value)) {
      sqlite3_bind_double(statement, place, *number);  // NaN becomes null
    } else if (const auto* const text = std::get_if<std::string_view>(&value)) {
      sqlite3_bind_text(statement, place, text->data(), static_cast<int>(text->size()),
                        SQLITE_STATIC);
    } else if (const auto* const bytes = std::get_if<Bytes>(&value)) {
      sqlite3_bind_blob(statement, place, bytes->data.data(), static_cast<int>(bytes->data.size()),
                        SQLITE_STATIC);
    } else {
      sqlite3_bind_null(statement, place);
    }
  }

  [[noreturn]] void fail(int status) const {
    const std::string message = sqlite3_errmsg(database_.get());
    if (status == SQLITE_NOTADB || status == SQLITE_CORRUPT) {
      throw DataError(path_, "the store is damaged: " + message);
    }
    throw OutputError(path_ + ": " + message);
  }

  std::string path_;
  std::unique_ptr<sqlite3, CloseDatabase> database_;
  std::map<std::string, Statement> statements_;  // must be destroyed before the connection
};

}  // namespace

std::unique_ptr<Database> open_sqlite(const std::string& path, bool may_create) {
  return std::make_unique<SqliteDatabase>(path, may_create);
}

#else

std::unique_ptr<Database> open_sqlite(const std::string& path, bool /*may_create*/) {
  throw RefusedError(path + ": this build lacks SQLite");
}

#endif

}  // namespace axiscal
