// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/error.hpp"
#include "store/src/database.hpp"

#ifdef AXISCAL_POSTGRESQL
#include <cstdlib>
#include <libpq-fe.h>
#include <limits>
#include <map>
#include <vector>

#include "axiscal/core/number_text.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_POSTGRESQL
namespace {

struct CloseConnection {
  void operator()(PGconn* connection) const { PQfinish(connection); }
};
struct ClearResult {
  void operator()(PGresult* result) const { PQclear(result); }
};
using Result = std::unique_ptr<PGresult, ClearResult>;

// The first row of a result. PostgreSQL delivers its values as text.
class PostgresqlRow final : public SqlRow {
 public:
  explicit PostgresqlRow(const PGresult* result) : result_(result) {}

  bool is_null(int column) const override { return PQgetisnull(result_, 0, column) == 1; }
  std::int64_t integer(int column) const override {
    return std::strtoll(PQgetvalue(result_, 0, column), nullptr, 10);
  }
  double number(int column) const override {
    return is_null(column) ? std::numeric_limits<double>::quiet_NaN()
                           : parse_number(PQgetvalue(result_, 0, column))
                                 .value_or(std::numeric_limits<double>::quiet_NaN());
  }
  std::string text(int column) const override {
    return {PQgetvalue(result_, 0, column),
            static_cast<std::size_t>(PQgetlength(result_, 0, column))};
  }
  std::string bytes(int column) const override {
    std::size_t size = 0;
    unsigned char* const data = PQunescapeBytea(
        reinterpret_cast<const unsigned char*>(PQgetvalue(result_, 0, column)), &size);
    std::string bytes(reinterpret_cast<const char*>(data), size);
    PQfreemem(data);
    return bytes;
  }

 private:
  const PGresult* result_;
};

class PostgresqlDatabase final : public Database {
 public:
  explicit PostgresqlDatabase(const std::string& address)
      : name_(without_password(address)), connection_(PQconnectdb(address.c_str())) {
    if (PQstatus(connection_.get()) != CONNECTION_OK) {
      throw DataError(name_, "no connection to the database: " + message());
    }
    PQsetNoticeProcessor(
        connection_.get(), [](void*, const char*) {}, nullptr);
  }

  const Dialect& dialect() const override {
    static constexpr Dialect postgresql = {
        .number_of_row = "BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY",
        .bytes = "BYTEA",
        .begin = "BEGIN",
        .lock_schema = "SELECT pg_advisory_xact_lock(7467536)",
        .has_table =
            "SELECT 1 FROM information_schema.tables WHERE table_schema = "
            "current_schema() AND table_name = $1",
        .has_tables = "SELECT 1 WHERE false"};  // a store may be among other tables
    return postgresql;
  }

  void execute(const std::string& sql,
               std::span<const SqlValue> values,
               const Take& take) override {
    std::vector<std::string> texts;  // zero-terminated copies of numbers and texts
    texts.reserve(values.size());
    std::vector<const char*> data;
    std::vector<int> sizes;
    std::vector<int> forms;  // format of each value: 0 for text, 1 for binary
    for (const SqlValue& value : values) {
      int form = 0;
      std::string_view own;
      bool is_null = false;
      if (const auto* const integer = std::get_if<std::int64_t>(&value)) {
        own = texts.emplace_back(std::to_string(*integer));
      } else if (const auto* const number = std::get_if<double>(&value)) {
        is_null = *number != *number;
        own = texts.emplace_back(is_null ? "" : number_text(*number));
      } else if (const auto* const text = std::get_if<std::string_view>(&value)) {
        own = texts.emplace_back(*text);  // the copy ends with a zero byte
      } else if (const auto* const bytes = std::get_if<Bytes>(&value)) {
        own = bytes->data;
        form = 1;
      } else {
        is_null = true;
      }
      data.push_back(is_null ? nullptr : own.data());
      sizes.push_back(static_cast<int>(own.size()));
      forms.push_back(form);
    }
    const std::string& statement = prepared(sql);
    if (PQsendQueryPrepared(connection_.get(), statement.c_str(), static_cast<int>(values.size()),
                            data.data(), sizes.data(), forms.data(), 0) != 1) {
      fail();
    }
    PQsetSingleRowMode(connection_.get());
    std::string defect;
    for (Result result(PQgetResult(connection_.get())); result;
         result.reset(PQgetResult(connection_.get()))) {
      const ExecStatusType status = PQresultStatus(result.get());
      if (status == PGRES_SINGLE_TUPLE) {
        if (take) {
          take(PostgresqlRow(result.get()));
        }
      } else if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK) {
        defect = PQresultErrorMessage(result.get());
      }
    }
    if (!defect.empty()) {
      fail();
    }
  }

 private:
  // Returns the name of the prepared statement for `sql`, and prepares it at the first call.
  const std::string& prepared(const std::string& sql) {
    std::string& name = statements_[sql];
    if (name.empty()) {
      std::string made = "s" + std::to_string(statements_.size());
      const Result result(PQprepare(connection_.get(), made.c_str(), sql.c_str(), 0, nullptr));
      if (PQresultStatus(result.get()) != PGRES_COMMAND_OK) {
        statements_.erase(sql);
        fail();
      }
      name = std::move(made);
    }
    return name;
  }

  // Returns the first line of the connection's error message.
  std::string message() const {
    std::string text = PQerrorMessage(connection_.get());
    return text.substr(0, text.find('\n'));
  }

  [[noreturn]] void fail() const {
    throw OutputError(name_ + ": " +
                      (PQstatus(connection_.get()) == CONNECTION_OK
                           ? message()
                           : "the connection to the database was lost: " + message()));
  }

  std::string name_;
  std::unique_ptr<PGconn, CloseConnection> connection_;
  std::map<std::string, std::string> statements_;
};

}  // namespace

std::unique_ptr<Database> open_postgresql(const std::string& address) {
  return std::make_unique<PostgresqlDatabase>(address);
}

#else

std::unique_ptr<Database> open_postgresql(const std::string& address) {
  throw RefusedError(without_password(address) + ": this build lacks PostgreSQL (libpq)");
}

#endif

}  // namespace axiscal
