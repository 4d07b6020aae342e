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

/// What a file may still cost. Each reader asks it before it spends; what stands within an archive
/// spends of the archive's. Copies share the account.
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

  /// @return whether so much may be spent, which it then is. For callbacks of C.
  [[nodiscard]] bool may_spend(ReadCost cost, double amount) const noexcept;

  /// @return the budget of what stands within an archive or a compressed file: the same, one
  /// deeper.
  /// @throws LimitError  if that is too deep.
  [[nodiscard]] ReadBudget within() const;

  /// @return how much of it is left.
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
