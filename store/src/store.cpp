// SPDX-License-Identifier: Apache-2.0
#include "axiscal/store/store.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#ifdef AXISCAL_ZSTD
#include <zstd.h>
#endif

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "store/src/database.hpp"
#include "store/src/schema.hpp"

namespace axiscal {
namespace {

#ifdef AXISCAL_ZSTD

std::string compressed(std::string_view text) {
  std::string bytes(ZSTD_compressBound(text.size()), '\0');
  const std::size_t size =
      ZSTD_compress(bytes.data(), bytes.size(), text.data(), text.size(), ZSTD_CLEVEL_DEFAULT);
  bytes.resize(size);
  return bytes;
}

std::string uncompressed(const std::string& bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  constexpr unsigned long long most = 1ULL << 30U;
  if (size > most) {
    throw DomainError("the record is not compressed with zstd");
  }
  std::string text(size, '\0');
  const std::size_t count = ZSTD_decompress(text.data(), text.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(count) != 0 || count != size) {
    throw DomainError("the compressed record is damaged");
  }
  return text;
}

#else

// In a build without zstd, records are stored uncompressed.
std::string compressed(std::string_view text) {
  return std::string(text);
}

std::string uncompressed(const std::string& bytes) {
  return bytes;
}

#endif

constexpr const char* head_columns =
    "k.serial, k.slot, k.model, k.kind, k.unit, k.measured, k.computed, k.status, k.passed, "
    "k.reason, k.limits, k.station, k.operator, k.batch, k.inputs, k.digest, k.id";
constexpr int id_column = 16;

StoredCalibration head_of(const SqlRow& row) {
  StoredCalibration one;
  int column = 0;
  for (std::string* const member : {&one.serial, &one.slot, &one.model, &one.kind, &one.unit,
                                    &one.measured, &one.computed, &one.status}) {
    *member = row.text(column++);
  }
  if (!row.is_null(column)) {
    one.passed = row.integer(column) != 0;
  }
  ++column;
  for (std::string* const member : {&one.reason, &one.limits, &one.station, &one.operated_by,
                                    &one.batch, &one.inputs, &one.digest}) {
    *member = row.text(column++);
  }
  return one;
}

StoredCoefficient coefficient_of(const SqlRow& row, int column) {
  return {.name = row.text(column),
          .value = row.number(column + 1),
          .u = row.number(column + 2),
          .u_noise = row.number(column + 3),
          .expanded = row.number(column + 4)};
}

// Returns the last second of a day for a date without a time; other texts stay unchanged. The
// result can be compared with other dates as text.
std::string end_of_day(const std::string& date) {
  constexpr std::size_t length_of_day = 10;  // 2026-11-29
  return date.size() == length_of_day ? date + "T23:59:59Z" : date;
}

// The WHERE clause for a filter, and the values of its placeholders.
struct Condition {
  explicit Condition(const StoreFilter& filter) {
    add("k.serial = ", filter.serial);
    add("k.slot = ", filter.slot);
    add("k.model = ", filter.model);
    add("k.kind = ", filter.kind);
    add("k.status = ", filter.status);
    add("k.station = ", filter.station);
    add("k.batch = ", filter.batch);
    add("k.operator = ", filter.operated_by);
    add("k.date >= ", filter.since);
    if (filter.until) {
      add("k.date <= ", end_of_day(*filter.until));
    }
  }
  Condition(const Condition&) = delete;
  Condition& operator=(const Condition&) = delete;

  void add(const char* comparison, const std::optional<std::string>& value) {
    if (value) {
      texts.push_back(std::make_unique<std::string>(*value));
      values.emplace_back(std::string_view(*texts.back()));
      sql += formatted("{} {}${}", sql.empty() ? " WHERE" : " AND", comparison, values.size());
    }
  }

  std::string sql;
  std::vector<SqlValue> values;
  std::vector<std::unique_ptr<std::string>> texts;
};

}  // namespace

const StoredCoefficient* StoredCalibration::coefficient(const std::string& wanted) const {
  const auto found = std::find_if(coefficients.begin(), coefficients.end(),
                                  [&](const StoredCoefficient& one) { return one.name == wanted; });
  return found == coefficients.end() ? nullptr : &*found;
}

bool is_good(const std::optional<bool>& passed, const std::string& status) {
  return passed.value_or(status == "ok" || status == "warning");
}

Store::Store(const std::string& address, Access access)
    : address_(without_password(address)),
      database_(is_postgresql(address) ? open_postgresql(address)
                                       : open_sqlite(address, access != Access::read)),
      version_(schema_of(*database_, address_)) {
  if (version_ > newest_schema()) {
    throw DataError(address_, formatted("has version {} of the schema, but this program supports "
                                        "only versions up to {}; install a newer axiscal",
                                        version_, newest_schema()));
  }
  if (version_ > 0 && version_ < newest_schema() && access != Access::migrate) {
    throw RefusedError(
        formatted("{} has the old version {} of the schema; run `axiscal store migrate --store {}`",
                  address_, version_, address_));
  }
  if (version_ == 0) {
    migrate();
  }
}

Store::~Store() = default;

void Store::migrate() {
  migrate_schema(*database_);
  version_ = newest_schema();
}

bool Store::add(const StoredCalibration& one) {
  if (!in_transaction_) {
    database_->execute(database_->dialect().begin);
    in_transaction_ = true;
  }
  const SqlValue passed =
      one.passed ? SqlValue(std::int64_t{*one.passed ? 1 : 0}) : SqlValue(std::monostate());
  std::int64_t id = -1;
  const std::array<SqlValue, 17> values = {
      one.serial,   one.slot,        one.model,  one.kind,   one.unit,   one.date(),
      one.measured, one.computed,    one.status, passed,     one.reason, one.limits,
      one.station,  one.operated_by, one.batch,  one.inputs, one.digest};
  database_->execute(
      "INSERT INTO axiscal_calibration (serial, slot, model, kind, unit, date, measured, computed, "
      "status, passed, reason, limits, station, operator, batch, inputs, digest) VALUES ($1, $2, "
      "$3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17) "
      "ON CONFLICT (serial, digest) DO NOTHING RETURNING id",
      values, [&](const SqlRow& row) { id = row.integer(0); });
  if (id < 0) {
    return false;
  }
  std::string sql =
      "INSERT INTO axiscal_coefficient (calibration, place, name, value, u, u_noise, expanded) "
      "VALUES ";
  std::vector<SqlValue> numbers;
  std::int64_t place = 0;
  for (const StoredCoefficient& coefficient : one.coefficients) {
    const std::size_t first = numbers.size() + 1;
    sql += formatted("{}(${}, ${}, ${}, ${}, ${}, ${}, ${})", place > 0 ? ", " : "", first,
                     first + 1, first + 2, first + 3, first + 4, first + 5, first + 6);
    numbers.insert(numbers.end(), {id, place++, coefficient.name, coefficient.value, coefficient.u,
                                   coefficient.u_noise, coefficient.expanded});
  }
  if (!numbers.empty()) {
    database_->execute(sql, numbers);
  }
  const std::string bytes = compressed(one.record);
  database_->execute("INSERT INTO axiscal_record (calibration, json) VALUES ($1, $2)",
                     std::array<SqlValue, 2>{id, Bytes{bytes}});
  return true;
}

void Store::commit() {
  if (in_transaction_) {
    database_->execute("COMMIT");
    in_transaction_ = false;
  }
}

void Store::for_each(const StoreFilter& filter,
                     StoredPart part,
                     const std::function<void(const StoredCalibration&)>& take) const {
  const Condition condition(filter);
  const bool with_record = part == StoredPart::record;
  const bool with_coefficients = part == StoredPart::coefficients;
  std::string sql = formatted("SELECT {}", head_columns);
  sql += with_record         ? ", r.json"
         : with_coefficients ? ", c.name, c.value, c.u, c.u_noise, c.expanded"
                             : "";
  sql += " FROM axiscal_calibration k";
  sql += with_record         ? " JOIN axiscal_record r ON r.calibration = k.id"
         : with_coefficients ? " LEFT JOIN axiscal_coefficient c ON c.calibration = k.id"
                             : "";
  sql += condition.sql + " ORDER BY k.serial, k.date, k.id";
  sql += with_coefficients ? ", c.place" : "";
  std::optional<StoredCalibration> pending;  // current calibration; its coefficients may follow
  std::int64_t pending_id = -1;
  database_->execute(sql, condition.values, [&](const SqlRow& row) {
    constexpr int part_column = id_column + 1;
    if (!with_coefficients) {
      StoredCalibration one = head_of(row);
      if (with_record) {
        one.record = uncompressed(row.bytes(part_column));
      }
      take(one);
      return;
    }
    if (!pending || row.integer(id_column) != pending_id) {
      if (pending) {
        take(*pending);
      }
      pending = head_of(row);
      pending_id = row.integer(id_column);
    }
    if (!row.is_null(part_column)) {
      pending->coefficients.push_back(coefficient_of(row, part_column));
    }
  });
  if (pending) {
    take(*pending);
  }
}

StoredCalibration Store::held(const StoreFilter& unit, const std::optional<std::string>& at) const {
  std::vector<StoredCalibration> all;
  for_each(unit, StoredPart::none, [&](const StoredCalibration& one) {
    if (one.status == "ok" || one.status == "warning") {
      all.push_back(one);
    }
  });
  const std::string serial = unit.serial.value_or("");
  if (all.empty()) {
    throw DataError(address_, formatted("does not contain a calibration of unit '{}'", serial));
  }
  for (const StoredCalibration& one : all) {
    if (one.kind != all.front().kind || one.slot != all.front().slot) {
      throw DataError(address_,
                      formatted("unit '{}' has calibrations of {} {} and {} {}; choose one by "
                                "--kind or --slot",
                                serial, all.front().kind, all.front().slot, one.kind, one.slot));
    }
  }
  const std::string until = at ? end_of_day(*at) : "";
  const auto later = std::find_if(all.begin(), all.end(), [&](const StoredCalibration& one) {
    return at && one.date() > until;
  });
  if (later == all.begin()) {
    throw DataError(address_, formatted("unit '{}' had no calibration at {}; the date of its first "
                                        "calibration is {}",
                                        serial, *at, all.front().date()));
  }
  const StoredCalibration& wanted = *std::prev(later);
  StoredCalibration found;
  database_->execute(
      formatted("SELECT {}, r.json FROM axiscal_calibration k JOIN axiscal_record r ON "
                "r.calibration = k.id WHERE k.serial = $1 AND k.digest = $2",
                head_columns),
      std::array<SqlValue, 2>{wanted.serial, wanted.digest}, [&](const SqlRow& row) {
        found = head_of(row);
        found.record = uncompressed(row.bytes(id_column + 1));
      });
  return found;
}

std::vector<StoreCount> Store::counts(const StoreFilter& filter) const {
  const Condition condition(filter);
  std::vector<StoreCount> all;
  database_->execute(
      "SELECT k.kind, k.model, k.status, k.passed, k.reason, count(*) FROM axiscal_calibration k" +
          condition.sql + " GROUP BY k.kind, k.model, k.status, k.passed, k.reason",
      condition.values, [&](const SqlRow& row) {
        all.push_back({.kind = row.text(0),
                       .model = row.text(1),
                       .status = row.text(2),
                       .passed = row.is_null(3) ? std::nullopt : std::optional(row.integer(3) != 0),
                       .reason = row.text(4),
                       .count = static_cast<std::size_t>(row.integer(5))});
      });
  return all;
}

std::vector<StoreDefect> Store::verify(
    const std::function<std::string(const StoredCalibration&)>& defect_of) const {
  std::vector<std::int64_t> ids;
  database_->execute("SELECT id FROM axiscal_calibration ORDER BY serial, date, id", {},
                     [&](const SqlRow& row) { ids.push_back(row.integer(0)); });
  std::vector<StoreDefect> defects;
  for (const std::int64_t id : ids) {
    StoredCalibration one;
    std::optional<std::string> json;
    const std::array<SqlValue, 1> key = {id};
    database_->execute(
        formatted("SELECT {}, r.json FROM axiscal_calibration k LEFT JOIN axiscal_record r ON "
                  "r.calibration = k.id WHERE k.id = $1",
                  head_columns),
        key, [&](const SqlRow& row) {
          one = head_of(row);
          if (!row.is_null(id_column + 1)) {
            json = row.bytes(id_column + 1);
          }
        });
    database_->execute(
        "SELECT name, value, u, u_noise, expanded FROM axiscal_coefficient WHERE calibration = $1 "
        "ORDER BY "
        "place",
        key, [&](const SqlRow& row) { one.coefficients.push_back(coefficient_of(row, 0)); });
    std::string defect = json ? "" : "the record is missing";
    if (json) {
      try {
        one.record = uncompressed(*json);
        defect = defect_of(one);
      } catch (const DomainError& error) {
        defect = error.what();
      }
    }
    if (!defect.empty()) {
      defects.push_back({.serial = one.serial, .date = one.date(), .defect = std::move(defect)});
    }
  }
  return defects;
}

}  // namespace axiscal
