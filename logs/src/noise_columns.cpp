// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <utility>

#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/logs/noise_json.hpp"

namespace axiscal {
namespace {

// @return the name in lower case without the letter of the axis at its end: "gyro." for "gyro.X".
std::string stem_of(const std::string& name) {
  std::string stem;
  std::transform(name.begin(), name.end(), std::back_inserter(stem),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::string_view letters = "xyz";
  if (!stem.empty() && letters.find(stem.back()) != std::string_view::npos) {
    stem.pop_back();
  }
  return stem;
}

bool is_of_kind(const std::string& stem, std::string_view kind) {
  const ColumnNames& names = find_instrument_kind(kind).columns;
  constexpr std::size_t longest_short_name = 2;
  return !names.word.empty() && !stem.empty() &&
         (stem.find(names.word) != std::string::npos ||
          (stem.size() <= longest_short_name &&
           names.letters.find(stem.front()) != std::string_view::npos));
}

}  // namespace

std::vector<const ColumnNoise*> columns_of_instrument(const LogNoise& noise,
                                                      std::string_view kind) {
  std::vector<std::pair<std::string, std::vector<const ColumnNoise*>>> instruments;
  for (const ColumnNoise& column : noise.columns) {
    const std::string stem = stem_of(column.name);
    auto found = std::find_if(instruments.begin(), instruments.end(),
                              [&](const auto& one) { return one.first == stem; });
    if (found == instruments.end()) {
      found = instruments.insert(found, {stem, {}});
    }
    found->second.push_back(&column);
  }
  const bool any_axes = std::any_of(instruments.begin(), instruments.end(),
                                    [](const auto& one) { return one.second.size() > 1; });
  const auto of_kind = std::find_if(instruments.begin(), instruments.end(),
                                    [&](const auto& one) { return is_of_kind(one.first, kind); });
  if (of_kind != instruments.end()) {
    return of_kind->second;
  }
  if (any_axes) {
    return instruments.front().second;
  }
  std::vector<const ColumnNoise*> all;  // the names do not show which columns belong together
  for (const ColumnNoise& column : noise.columns) {
    all.push_back(&column);
  }
  return all;
}

}  // namespace axiscal
