// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "axiscal/core/error.hpp"
#include "axiscal/logs/read_limits.hpp"

namespace axiscal {

/// A file costs more than its limit: no other way of reading it is tried.
class LimitError : public DataError {
 public:
  using DataError::DataError;
};

/// The remaining cost that a file may cause. Each reader asks before it spends. The parts of an
/// archive share the archive's budget. Copies share one account.
class ReadBudget {
 public:
  /// @param path  of the file, for messages.
  explicit ReadBudget(std::string path = "", const ReadLimits& limits = {});

  /// So many more bytes of the file are known to be there.
  void add_file_bytes(std::size_t count) const;

  /// @throws LimitError  if the file has then cost more than its limit; it names the limit.
  void spend(ReadCost cost, double amount) const;
  void spend(ReadCost cost, std::size_t amount) const { spend(cost, static_cast<double>(amount)); }

  /// @throws LimitError  if so much more would be too much; none of it is spent.
  void check(ReadCost cost, double amount) const;

  /// @return true if this cost is allowed; if so, it is spent. For callbacks of C.
  [[nodiscard]] bool may_spend(ReadCost cost, double amount) const noexcept;

  /// @return the budget for a part of an archive or the content of a compressed file: shared, one
  ///         level deeper.
  /// @throws LimitError  if that is too deep.
  [[nodiscard]] ReadBudget within() const;

  /// @return the remaining amount.
  [[nodiscard]] double left(ReadCost cost) const noexcept;

  [[nodiscard]] double file_bytes() const noexcept;

  /// @throws LimitError
  [[noreturn]] void fail(ReadCost cost) const;

 private:
  struct Account;
  std::shared_ptr<Account> account_;
  int nesting_ = 0;
};

}  // namespace axiscal
