// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace axiscal {

/// The members 0 .. n - 1 of a list in groups of one key; groups in the order of their first
/// members, and members in their own order.
class Groups {
 public:
  /// The number of a member that is in no group.
  static constexpr int none = -1;

  /// @param key_of  of member i; of a type with == and <.
  /// @param counts  whether member i is in a group.
  template <typename KeyOf, typename Counts>
  Groups(std::size_t n, const KeyOf& key_of, const Counts& counts) : numbers_(n, none) {
    using Key = std::decay_t<decltype(key_of(std::size_t{0}))>;
    constexpr std::size_t few = 48;  // of which a look at each is quicker than a tree
    if (n <= few) {
      std::vector<Key> keys;
      keys.reserve(n);
      number(counts, [&](std::size_t i) {
        Key key = key_of(i);
        const auto found = std::find(keys.begin(), keys.end(), key);
        const auto place = found - keys.begin();
        if (found == keys.end()) {
          keys.push_back(std::move(key));
        }
        return static_cast<int>(place);
      });
    } else {
      std::map<Key, int> keys;
      number(counts, [&](std::size_t i) {
        return keys.emplace(key_of(i), static_cast<int>(keys.size())).first->second;
      });
    }
    for (std::size_t g = 1; g < starts_.size(); ++g) {
      starts_[g] += starts_[g - 1];
    }
    members_.resize(starts_.empty() ? 0 : starts_.back());
    for (std::size_t i = n; i-- > 0;) {
      if (numbers_[i] != none) {
        members_[--starts_[static_cast<std::size_t>(numbers_[i])]] = i;
      }
    }
  }

  template <typename KeyOf>
  Groups(std::size_t n, const KeyOf& key_of) : Groups(n, key_of, [](std::size_t) { return true; }) {}

  [[nodiscard]] std::size_t size() const { return starts_.size(); }

  /// @return the members of a group.
  [[nodiscard]] std::span<const std::size_t> operator[](std::size_t group) const {
    const std::size_t first = starts_[group];
    return std::span(members_).subspan(
        first, (group + 1 < starts_.size() ? starts_[group + 1] : members_.size()) - first);
  }

  /// @return n: the group of each member.
  [[nodiscard]] const std::vector<int>& numbers() const { return numbers_; }

 private:
  // Numbers the members, and counts those of each group.
  template <typename Counts, typename NumberOf>
  void number(const Counts& counts, const NumberOf& number_of) {
    for (std::size_t i = 0; i < numbers_.size(); ++i) {
      if (counts(i)) {
        numbers_[i] = number_of(i);
        starts_.resize(std::max(starts_.size(), static_cast<std::size_t>(numbers_[i]) + 1));
        ++starts_[static_cast<std::size_t>(numbers_[i])];
      }
    }
  }

  std::vector<int> numbers_;
  std::vector<std::size_t> members_;
  std::vector<std::size_t> starts_;  // of the groups, in members_
};

}  // namespace axiscal
