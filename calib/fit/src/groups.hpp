// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace axiscal {

/// Groups the members 0 .. n - 1 of a list by a key. Groups are in the order of their first
/// members; the members of a group are in ascending order.
class Groups {
 public:
  /// The group number of a member that is in no group.
  static constexpr int none = -1;

  /// @param key_of  function that returns the key of member i; the key has == and <.
  /// @param counts  function that returns true if member i is in a group.
  template <typename KeyOf, typename Counts>
  Groups(std::size_t n, const KeyOf& key_of, const Counts& counts) : numbers_(n, none) {
    using Key = std::decay_t<decltype(key_of(std::size_t{0}))>;
    constexpr std::size_t few = 48;  // for up to 48 members, a linear search is faster than a map
    if (n <= few) {
      std::vector<Key> keys;
      keys.reserve(n);
      for (std::size_t i = 0; i < n; ++i) {
        if (counts(i)) {
          Key key = key_of(i);
          const auto found = std::find(keys.begin(), keys.end(), key);
          numbers_[i] = static_cast<int>(found - keys.begin());
          if (found == keys.end()) {
            keys.push_back(std::move(key));
          }
        }
      }
      put_members(keys.size());
    } else {
      std::map<Key, int> keys;
      for (std::size_t i = 0; i < n; ++i) {
        if (counts(i)) {
          numbers_[i] = keys.emplace(key_of(i), static_cast<int>(keys.size())).first->second;
        }
      }
      put_members(keys.size());
    }
  }

  template <typename KeyOf>
  Groups(std::size_t n, const KeyOf& key_of)
      : Groups(n, key_of, [](std::size_t) { return true; }) {}

  [[nodiscard]] std::size_t size() const { return starts_.size() - 1; }

  /// @return the members of a group.
  [[nodiscard]] std::span<const std::size_t> operator[](std::size_t group) const {
    return std::span(members_).subspan(starts_[group], starts_[group + 1] - starts_[group]);
  }

  /// @return the group number of each of the n members.
  [[nodiscard]] const std::vector<int>& numbers() const { return numbers_; }

 private:
  void put_members(std::size_t groups) {
    starts_.assign(groups + 1, 0);
    for (const int number : numbers_) {
      if (number != none) {
        ++starts_[static_cast<std::size_t>(number)];
      }
    }
    // starts_ now contains the end of each group. The loop below moves it to the group's start.
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    members_.resize(starts_.back());
    for (std::size_t i = numbers_.size(); i-- > 0;) {
      if (numbers_[i] != none) {
        members_[--starts_[static_cast<std::size_t>(numbers_[i])]] = i;
      }
    }
  }

  std::vector<int> numbers_;
  std::vector<std::size_t> members_;
  // Index in members_ of the first member of each group. The last element is the number of members.
  std::vector<std::size_t> starts_;
};

}  // namespace axiscal
