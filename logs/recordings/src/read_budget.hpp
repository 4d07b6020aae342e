// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "axiscal/core/error.hpp"
#include "axiscal/logs/read_limits.hpp"

namespace axiscal {

/// Thrown if reading a file exceeds one of the ReadLimits. The reader then tries no other format or
/// member of the file.
class LimitError : public DataError {
 public:
  using DataError::DataError;
};

/// The amount of each ReadCost that may still be spent on reading a file. A reader calls spend()
/// before it causes a cost. All copies of a budget, and the budgets of the parts of an archive,
/// share the same amounts.
class ReadBudget {
 public:
  /// @param path  path of the file, for messages.
  explicit ReadBudget(std::string path = "", const ReadLimits& limits = {});

  /// Adds `count` bytes to the known size of the file.
  void add_file_bytes(std::size_t count) const;

  /// Adds an amount to the total of a cost.
  /// @throws LimitError  if the total cost is now more than its limit; the message names the limit.
  void spend(ReadCost cost, double amount) const;
  void spend(ReadCost cost, std::size_t amount) const { spend(cost, static_cast<double>(amount)); }

  /// Checks that an amount can be spent, but does not spend it.
  /// @throws LimitError  if `amount` is more than left().
  void check(ReadCost cost, double amount) const;

  /// Spends an amount like spend(), but does not throw. It is for callbacks of C libraries.
  /// @return true if the total cost is within its limit.
  [[nodiscard]] bool may_spend(ReadCost cost, double amount) const noexcept;

  /// @return a budget that shares the amounts of this budget, but is nested one level deeper. It is
  ///         used for a part of an archive or the content of a compressed file.
  /// @throws LimitError  if the nesting is too deep.
  [[nodiscard]] ReadBudget within() const;

  /// @return the amount of the cost that can still be spent.
  [[nodiscard]] double left(ReadCost cost) const noexcept;

  [[nodiscard]] double file_bytes() const noexcept;

  /// Reports that the limit of a cost is exceeded.
  /// @throws LimitError  always.
  [[noreturn]] void fail(ReadCost cost) const;

 private:
  struct Account;
  std::shared_ptr<Account> account_;
  int nesting_ = 0;
};

}  // namespace axiscal
