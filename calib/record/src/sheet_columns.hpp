// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <vector>

#include "axiscal/calib/observations.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {

/// A part of the field that has its own level has the column level.NAME.
inline const std::string level_column_prefix = "level.";

/// The columns that every table of design points begins with; mount, level and temperature where
/// they say something.
class SheetColumns {
 public:
  explicit SheetColumns(const std::vector<Reading>& readings) {
    for (const Reading& reading : readings) {
      with_mount_ = with_mount_ || reading.mount != 1;
      with_level_ = with_level_ || reading.level.of_all() != 1.0;
      for (const auto& [name, level] : reading.level.of_parts()) {
        parts_.insert(name);
      }
      with_temperature_ = with_temperature_ || reading.temperature.has_value();
    }
  }

  void show_level() { with_level_ = true; }

  [[nodiscard]] std::vector<std::string> header() const {
    std::vector<std::string> cells = {"run", "block", "rest", "fence"};
    if (with_mount_) {
      cells.emplace_back("mount");
    }
    if (with_level_) {
      cells.emplace_back("level");
    }
    for (const std::string& part : parts_) {
      cells.push_back(level_column_prefix + part);
    }
    if (with_temperature_) {
      cells.emplace_back("temperature");
    }
    return cells;
  }

  [[nodiscard]] std::vector<std::string> cells(const Reading& reading) const {
    std::vector<std::string> cells = {std::to_string(reading.run), std::to_string(reading.block),
                                      std::string(face_name(reading.point->rest())),
                                      std::string(face_name(reading.point->fence()))};
    if (with_mount_) {
      cells.push_back(std::to_string(reading.mount));
    }
    if (with_level_) {
      cells.push_back(number_text(reading.level.of_all()));
    }
    for (const std::string& part : parts_) {
      cells.push_back(number_text(reading.level.of(part)));
    }
    if (with_temperature_) {
      cells.push_back(reading.temperature ? number_text(*reading.temperature) : "");
    }
    return cells;
  }

 private:
  bool with_mount_ = false;
  bool with_level_ = false;
  bool with_temperature_ = false;
  std::set<std::string> parts_;  // that have levels of their own
};

}  // namespace axiscal
