// SPDX-License-Identifier: Apache-2.0
#include "axiscal/core/nearest_name.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "core/formatted.hpp"

namespace axiscal {
namespace {

char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// Returns the optimal string alignment distance, which is the smallest number of insertions,
// deletions, replacements and swaps of neighbouring characters that change a to b (Damerau 1964).
std::size_t edits(std::string_view a, std::string_view b) {
  const std::size_t columns = b.size() + 1;
  std::vector<std::size_t> before_last(columns);
  std::vector<std::size_t> last(columns);
  std::vector<std::size_t> current(columns);
  for (std::size_t j = 0; j < columns; ++j) {
    last[j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j < columns; ++j) {
      const std::size_t replaced = lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1;
      current[j] = std::min({last[j] + 1, current[j - 1] + 1, last[j - 1] + replaced});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
          lower(a[i - 2]) == lower(b[j - 1])) {
        current[j] = std::min(current[j], before_last[j - 2] + 1);
      }
    }
    std::swap(before_last, last);
    std::swap(last, current);
  }
  return last[b.size()];
}

}  // namespace

std::string_view nearest_name(std::string_view name, std::span<const std::string_view> candidates) {
  std::string_view nearest;
  std::size_t fewest = std::max<std::size_t>(1, name.size() / 3) + 1;
  for (const std::string_view candidate : candidates) {
    const std::size_t distance = edits(name, candidate);
    if (distance < fewest) {
      fewest = distance;
      nearest = candidate;
    }
  }
  if (nearest.empty() && name.size() >= 3) {
    const auto longer = std::find_if(candidates.begin(), candidates.end(),
                                     [&](std::string_view c) { return c.starts_with(name); });
    nearest = longer == candidates.end() ? nearest : *longer;
  }
  return nearest;
}

std::string did_you_mean(std::string_view name, std::span<const std::string_view> candidates) {
  const std::string_view nearest = nearest_name(name, candidates);
  return nearest.empty() ? "" : formatted("; did you mean '{}'?", nearest);
}

std::string did_you_mean(std::string_view name,
                         std::span<const std::string_view> candidates,
                         std::string_view what_there_is) {
  const std::string question = did_you_mean(name, candidates);
  if (question.empty()) {
    return formatted("; {}", what_there_is);
  }
  std::string sentence(what_there_is);
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return formatted("{} {}", question, sentence);
}

}  // namespace axiscal
