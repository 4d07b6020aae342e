// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace axiscal {

/// A coefficient of a stored calibration, in the units of its record.
struct StoredCoefficient {
  std::string name;  ///< "x.bias", "x.sensitivity.y"
  double value = 0.0;
  double u = 0.0;         ///< standard uncertainty; NaN if it is not known
  double u_noise = 0.0;   ///< part of u from the noise of the readings; NaN if not known
  double expanded = 0.0;  ///< half-width of the 95 % confidence interval; NaN if not known
};

/// A calibration in a store: the JSON record, and the values by which a store is searched.
struct StoredCalibration {
  std::string serial, slot, model, kind, unit;
  std::string measured;        ///< time of the last reading; ISO 8601, UTC; empty if not stated
  std::string computed;        ///< time at which the record was made; ISO 8601, UTC
  std::string status;          ///< "ok", "warning", "refused", or "error" if there is no record
  std::optional<bool> passed;  ///< true if all limits are met; nullopt without limits
  std::string reason;          ///< reason of the failure, the refusal or the warning
  std::string limits;          ///< SHA-256 of the limits; empty without limits
  std::string station, operated_by, batch;  ///< empty if not stated
  std::string inputs;  ///< SHA-256 of the files of readings, separated by blanks
  std::string digest;  ///< SHA-256 of the record without the time at which it was computed
  std::vector<StoredCoefficient> coefficients;
  std::string record;  ///< JSON in one line

  /// @return the time from which the calibration is valid: `measured` if stated, else `computed`.
  [[nodiscard]] const std::string& date() const { return measured.empty() ? computed : measured; }

  /// @return the coefficient with this name; null if there is none.
  [[nodiscard]] const StoredCoefficient* coefficient(const std::string& wanted) const;
};

/// Selects calibrations. A calibration must match every member that is set.
struct StoreFilter {
  std::optional<std::string> serial, slot, model, kind, status, station, batch, operated_by;
  std::optional<std::string> since, until;  ///< first and last permitted StoredCalibration::date()
};

/// The part of a calibration that Store::for_each() reads in addition to the main table.
enum class StoredPart { none, coefficients, record };

/// @return `passed` if it has a value; otherwise true if the status is "ok" or "warning".
/// @param passed, status  as in StoredCalibration.
[[nodiscard]] bool is_good(const std::optional<bool>& passed, const std::string& status);

/// The number of calibrations with the same kind, model, status, verdict and reason.
struct StoreCount {
  std::string kind, model, status;
  std::optional<bool> passed;
  std::string reason;
  std::size_t count = 0;
};

/// A damaged entry of a store.
struct StoreDefect {
  std::string serial, date, defect;
};

/// A database of calibrations: an SQLite file or a PostgreSQL database.
///
/// Several processes may write at the same time. A calibration that is already in the store is not
/// added again. The JSON of a record is complete and can be read without the other columns.
///
/// @code
/// axiscal::Store store("lab.db", axiscal::Store::Access::write);
/// store.add(calibration);
/// store.commit();
/// @endcode
class Store {
 public:
  enum class Access : std::uint8_t {
    read,    ///< opens an existing store; a database without tables becomes an empty store
    write,   ///< opens a store, and makes it if it does not exist
    migrate  ///< like `write`, but also opens a store with an older schema
  };

  /// @param address  the path of an SQLite file, or postgresql://USER@HOST/DATABASE.
  /// @throws DataError     if there is no such store, it is another program's database, or its
  ///                       schema is newer than this program's.
  /// @throws RefusedError  if the store's schema is older than this program's (Access::migrate
  ///                       opens such a store), or this build does not support the database.
  Store(const std::string& address, Access access);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// @return the version of the store's schema.
  [[nodiscard]] int version() const { return version_; }

  /// Updates the schema to the newest version. The calibrations stay unchanged.
  void migrate();

  /// Stores a calibration in the current transaction; begins a transaction if there is none.
  /// @return false if the same record of this instrument is stored already.
  /// @throws OutputError  if the calibration cannot be stored, e.g. because the disk is full.
  bool add(const StoredCalibration& calibration);

  /// Ends the transaction, so that all added calibrations are in the database.
  /// @throws OutputError  if the database is full or unreachable.
  void commit();

  /// Calls `take` for each calibration that matches the filter, sorted by serial number and date.
  void for_each(const StoreFilter& filter,
                StoredPart part,
                const std::function<void(const StoredCalibration&)>& take) const;

  /// Finds the calibration that was valid for an instrument at the time `at`.
  /// @return the newest calibration with the status "ok" or "warning" whose date is not after `at`.
  /// @param at  time in ISO 8601, UTC; a date without a time means the end of that day. If nullopt,
  ///            the newest calibration is returned.
  /// @throws DataError  if there is no such calibration, or if calibrations of several kinds or
  ///                    slots match `unit`; the message names two of them.
  [[nodiscard]] StoredCalibration held(const StoreFilter& unit,
                                       const std::optional<std::string>& at) const;

  /// @return the numbers of calibrations with the same kind, model, status, verdict and reason.
  [[nodiscard]] std::vector<StoreCount> counts(const StoreFilter& filter) const;

  /// Checks each calibration: its record must exist, and `defect_of` must find no defect.
  /// @param defect_of  compares the record with the other members, and returns a description of a
  ///                   difference; empty if there is none.
  /// @return the damaged calibrations.
  [[nodiscard]] std::vector<StoreDefect> verify(
      const std::function<std::string(const StoredCalibration&)>& defect_of) const;

 private:
  std::string address_;
  std::unique_ptr<class Database> database_;
  int version_ = 0;
  bool in_transaction_ = false;
};

}  // namespace axiscal
