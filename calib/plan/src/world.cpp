// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/nearest_name.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

// The name of a member of World, and a pointer to it. Both pointers are null for `tails` and
// `stated`, which have other types.
struct Entry {
  std::string_view name;
  double World::*number = nullptr;
  std::vector<double> World::*by_axis = nullptr;
};

constexpr std::array entries = {
    Entry{.name = "block_sd", .number = &World::block_sd},
    Entry{.name = "seat_rad", .number = &World::seat_rad},
    Entry{.name = "mount_rad", .number = &World::mount_rad},
    Entry{.name = "remount_rad", .number = &World::remount_rad},
    Entry{.name = "gain", .number = &World::gain},
    Entry{.name = "jitter", .number = &World::jitter},
    Entry{.name = "wander", .number = &World::wander},
    Entry{.name = "ends", .number = &World::ends},
    Entry{.name = "periodic", .number = &World::periodic},
    Entry{.name = "ar", .number = &World::ar},
    Entry{.name = "ar_white", .number = &World::ar_white},
    Entry{.name = "walk_sd", .number = &World::walk_sd},
    Entry{.name = "drift", .number = &World::drift},
    Entry{.name = "round", .number = &World::round},
    Entry{.name = "tails"},
    Entry{.name = "k2", .by_axis = &World::k2},
    Entry{.name = "k3", .by_axis = &World::k3},
    Entry{.name = "stated"},
};

// Throws DomainError if a value is outside the limits of its entry.
void check_value(std::string_view name, double value) {
  const auto must_be = [&](bool is_so, std::string_view what) {
    if (!is_so || !std::isfinite(value)) {
      throw DomainError(formatted("{}: the value {} must be {}", name, number_text(value), what));
    }
  };
  if (name == "ar") {
    must_be(std::abs(value) < 1.0, "between -1 and 1");
  } else if (name == "tails") {
    must_be(value == 0.0 || (value >= 3.0 && value <= 1e6 && value == std::floor(value)),
            "a whole number of at least 3, or 0 for normal noise");
  } else if (name == "stated") {
    must_be(value == 0.0 || value == 1.0, "0 or 1");
  } else if (name == "drift" || name == "k2" || name == "k3") {
    must_be(true, "a number");
  } else {
    must_be(value >= 0.0, "a number that is not negative");
  }
}

void put(World& world, std::string_view name, const std::vector<double>& values) {
  const auto* const entry = std::find_if(entries.begin(), entries.end(),
                                         [&](const Entry& one) { return one.name == name; });
  if (entry == entries.end()) {
    std::vector<std::string_view> names;
    for (const Entry& one : entries) {
      names.push_back(one.name);
    }
    throw DomainError(formatted("'{}' in 'world' is not a known effect{}", name,
                                did_you_mean(name, names, "the entries are " + world_names())));
  }
  for (const double value : values) {
    check_value(name, value);
  }
  if (entry->by_axis != nullptr) {
    world.*(entry->by_axis) = values;
    return;
  }
  if (values.size() != 1) {
    throw DomainError(formatted("{}: must be one number", name));
  }
  if (entry->number != nullptr) {
    world.*(entry->number) = values.front();
  } else if (name == "tails") {
    world.tails = static_cast<int>(values.front());
  } else {
    world.stated = values.front() != 0.0;
  }
}

// Returns the numbers of an entry; empty if they are all 0.
std::vector<double> numbers_of(const World& world, const Entry& entry) {
  if (entry.by_axis != nullptr) {
    const std::vector<double>& values = world.*(entry.by_axis);
    const bool any = std::any_of(values.begin(), values.end(), [](double v) { return v != 0.0; });
    return any ? values : std::vector<double>{};
  }
  const double value = entry.number != nullptr ? world.*(entry.number)
                       : entry.name == "tails" ? static_cast<double>(world.tails)
                                               : static_cast<double>(world.stated);
  return value != 0.0 ? std::vector{value} : std::vector<double>{};
}

}  // namespace

bool World::is_white() const {
  return std::all_of(entries.begin(), entries.end(),
                     [&](const Entry& entry) { return numbers_of(*this, entry).empty(); });
}

std::string world_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries) {
    names.emplace_back(entry.name);
  }
  return joined(names);
}

World world_of(std::string_view text) {
  World world;
  if (trimmed(text).empty()) {
    return world;
  }
  for (const std::string_view item : split(text, ',')) {
    const std::size_t parting = item.find('=');
    if (parting == std::string_view::npos) {
      throw DomainError(formatted("'{}' must be NAME=VALUE", item));
    }
    const std::string_view name = item.substr(0, parting);
    std::vector<double> values;
    for (const std::string_view number : split(item.substr(parting + 1), ':')) {
      const std::optional<double> value = parse_number(number);
      if (!value) {
        throw DomainError(formatted("{}: '{}' is not a number", name, number));
      }
      values.push_back(*value);
    }
    put(world, name, values);
  }
  return world;
}

World read_world(const std::string& path) {
  const JsonValue json = parse_json(read_whole_file(path), path);
  json.require_format("axiscal-world");
  World world;
  for (const std::string& key : json.keys()) {
    if (key == "format" || key == "version") {
      continue;
    }
    const JsonValue value = json.at(key);
    std::vector<double> values;
    if (value.is_array()) {
      const Eigen::VectorXd all = value.vector();
      values.assign(all.begin(), all.end());
    } else {
      values = {key == "stated" ? static_cast<double>(value.boolean()) : value.number()};
    }
    value.check([&] { put(world, key, values); });
  }
  return world;
}

std::string world_text(const World& world) {
  std::string text;
  for (const Entry& entry : entries) {
    const std::vector<double> numbers = numbers_of(world, entry);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      text += i > 0 ? std::string(":") : formatted("{}{}=", text.empty() ? "" : ",", entry.name);
      text += number_text(numbers[i]);
    }
  }
  return text;
}

}  // namespace axiscal
