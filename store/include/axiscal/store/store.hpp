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
  double u_noise = 0.0;   ///< the part of u that comes from reading noise; NaN if it is not known
  double expanded = 0.0;  ///< half the width of the 95 % interval; NaN if it is not known
};

/// A calibration as a store keeps it: the record, and the members of it that are searched for.
struct StoredCalibration {
  std::string serial, slot, model, kind, unit;
  std::string measured;  ///< when the last reading was taken; ISO 8601, UTC; empty if not stated
  std::string computed;  ///< when the record was made; ISO 8601, UTC
  std::string status;    ///< "ok", "warning", "refused", or "error" if there is no record
  std::optional<bool> passed;  ///< the verdict by limits; nullopt without limits
  std::string reason;          ///< why it failed, was refused or warns
  std::string limits;          ///< SHA-256 of the verdict's limits; empty without limits
  std::string station, operated_by, batch;  ///< empty if not stated
  std::string inputs;  ///< SHA-256 of the files of readings, separated by blanks
  std::string digest;  ///< SHA-256 of the record without the time at which it was computed
  std::vector<StoredCoefficient> coefficients;
  std::string record;  ///< JSON in one line

  /// @return the time from which the calibration holds: measured, else computed.
  [[nodiscard]] const std::string& date() const { return measured.empty() ? computed : measured; }
};

/// Which calibrations are wanted; members that are not set do not restrict.
struct StoreFilter {
  std::optional<std::string> serial, slot, model, kind, status, station, batch, operated_by;
  std::optional<std::string> since, until;  ///< of StoredCalibration::date(); both included
};

/// The part of a calibration that is read besides its columns.
enum class StoredPart { none, coefficients, record };

/// The number of calibrations with equal results, for a yield.
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

/// A database of calibrations: a file of SQLite, or PostgreSQL.
///
/// Several processes may write at the same time. A calibration that is stored already is not
/// stored again. Each record can be read by its JSON alone.
///
/// @code
/// axiscal::Store store("lab.db", axiscal::Store::Access::write);
/// store.add(calibration);
/// store.commit();
/// @endcode
class Store {
 public:
  enum class Access : std::uint8_t {
    read,    ///< an existing store; a database without tables becomes an empty one
    write,   ///< makes the store if it does not exist
    migrate  ///< as write; a store of an older schema is opened too
  };

  /// @param address  the path of a file of SQLite, or postgresql://USER@HOST/DATABASE.
  /// @throws DataError     if there is no such store, it is another program's database, or its
  ///                       schema is newer than schema_version().
  /// @throws RefusedError  if its schema is older (Access::migrate opens it), or this build lacks
  ///                       the database.
  Store(const std::string& address, Access access);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// @return true if the text is the address of a store: postgresql://.., or a file whose name ends
  ///         in .db.
  [[nodiscard]] static bool is_address(const std::string& text);

  /// The version of the schema that this program writes.
  [[nodiscard]] static int schema_version();

  /// @return the version of the store's schema.
  [[nodiscard]] int version() const { return version_; }

  /// Brings the schema to schema_version(). No calibration changes.
  void migrate();

  /// Stores a calibration within the present transaction.
  /// @return false if the same record of this unit is stored already.
  /// @throws OutputError  if it cannot be written, for example because the disk is full.
  bool add(const StoredCalibration& calibration);

  /// Ends the transaction: the calibrations so far are in the database.
  /// @throws OutputError  as add().
  void commit();

  /// Gives the wanted calibrations in the order of their serial numbers and dates.
  void for_each(const StoreFilter& filter,
                StoredPart part,
                const std::function<void(const StoredCalibration&)>& take) const;

  /// @return the calibration that held for a unit at a time: the last one that was not refused.
  /// @param at  ISO 8601, UTC; a day stands for its end. nullopt: the newest.
  /// @throws DataError  if there is none, or units of several kinds have this serial number; the
  ///                    message says which there are.
  [[nodiscard]] StoredCalibration held(const StoreFilter& unit,
                                       const std::optional<std::string>& at) const;

  /// @return how many calibrations have the same kind, model, status, verdict and reason.
  [[nodiscard]] std::vector<StoreCount> counts(const StoreFilter& filter) const;

  /// Checks each record against its digest and its columns.
  /// @param defect_of  says how a record differs from the columns; empty if it does not.
  [[nodiscard]] std::vector<StoreDefect> verify(
      const std::function<std::string(const StoredCalibration&)>& defect_of) const;

 private:
  std::string address_;
  std::unique_ptr<class Database> database_;
  int version_ = 0;
  bool in_transaction_ = false;
};

}  // namespace axiscal
