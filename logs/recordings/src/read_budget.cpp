// SPDX-License-Identifier: Apache-2.0
#include "logs/recordings/src/read_budget.hpp"

#include <algorithm>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

struct Limit {
  std::string_view name, of;
  double basis, per_byte;  // limit = basis + per_byte * (size of the file in bytes)
};

// The limits are in the order of ReadCost. docs/formats.md lists the same limits.
constexpr double MiB = 1024.0 * 1024.0;
constexpr std::array<Limit, ReadLimits::count> limits = {
    {{"nesting", "levels of nested archives", 3.0, 0.0},
     {"members", "files in an archive", 10000.0, 0.0},
     {"unpacked", "unpacked bytes", 64.0 * MiB, 250.0},
     {"cells", "cells", 4e6, 50.0},
     {"steps", "steps", 5e6, 1000.0},
     {"memory", "bytes of memory", 96.0 * MiB, 250.0},
     {"disk", "bytes of temporary copies", 16.0 * MiB, 16.0}}};

constexpr std::array<std::string_view, ReadLimits::count> names = {
    limits[0].name, limits[1].name, limits[2].name, limits[3].name,
    limits[4].name, limits[5].name, limits[6].name};

std::size_t place_of(ReadCost cost) {
  return static_cast<std::size_t>(cost);
}

}  // namespace

void ReadLimits::set(ReadCost cost, double most) {
  if (!(most >= 0.0)) {
    throw DomainError(
        formatted("the limit '{}' must not be negative or NaN", names[place_of(cost)]));
  }
  set_[place_of(cost)] = most;
}

double ReadLimits::of(ReadCost cost, double file_size) const {
  const Limit& usual = limits[place_of(cost)];
  return set_[place_of(cost)].value_or(usual.basis + usual.per_byte * file_size);
}

std::span<const std::string_view> read_limit_names() {
  return names;
}

struct ReadBudget::Account {
  std::string path;
  ReadLimits limits;
  double file_bytes = 0.0;
  std::array<double, ReadLimits::count> spent{};
};

ReadBudget::ReadBudget(std::string path, const ReadLimits& limits)
    : account_(std::make_shared<Account>(Account{std::move(path), limits})) {}

void ReadBudget::add_file_bytes(std::size_t count) const {
  account_->file_bytes += static_cast<double>(count);
}

double ReadBudget::file_bytes() const noexcept {
  return account_->file_bytes;
}

double ReadBudget::left(ReadCost cost) const noexcept {
  return account_->limits.of(cost, account_->file_bytes) - account_->spent[place_of(cost)];
}

bool ReadBudget::may_spend(ReadCost cost, double amount) const noexcept {
  account_->spent[place_of(cost)] += amount;
  return left(cost) >= 0.0;
}

void ReadBudget::spend(ReadCost cost, double amount) const {
  if (!may_spend(cost, amount)) {
    fail(cost);
  }
}

void ReadBudget::check(ReadCost cost, double amount) const {
  if (amount > left(cost)) {
    fail(cost);
  }
}

ReadBudget ReadBudget::within() const {
  ReadBudget inner = *this;
  if (++inner.nesting_ > account_->limits.of(ReadCost::nesting, 0.0)) {
    fail(ReadCost::nesting);
  }
  return inner;
}

void ReadBudget::fail(ReadCost cost) const {
  const Limit& limit = limits[place_of(cost)];
  throw LimitError(
      account_->path,
      formatted("reading requires more than {} {}, which is the limit '{}' for a file of {} bytes; "
                "raise this limit if you trust the file",
                number_text(account_->limits.of(cost, account_->file_bytes), 4), limit.of,
                limit.name, number_text(account_->file_bytes)),
      {settings::read_limit});
}

}  // namespace axiscal
