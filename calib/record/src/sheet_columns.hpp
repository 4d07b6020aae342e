// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/calib/observations.hpp"
#include "axiscal/core/number_text.hpp"

namespace axiscal {

/// Prefix of the columns level.NAME. Such a column contains the level of the field's part NAME.
inline const std::string level_column_prefix = "level.";

/// The columns of a table of readings that precede the responses. `run` and `block` are always
/// present. The columns for design point, mount, level, confirm and temperature are present only if
/// at least one reading has a value that differs from the default.
class SheetColumns {
 public:
  /// @param axes  names of the axes, for the columns AXIS_temperature.
  explicit SheetColumns(const std::vector<Reading>& readings, std::vector<std::string> axes = {})
      : axes_(std::move(axes)) {
    for (const Reading& reading : readings) {
      with_point_ = with_point_ || reading.point;
      with_mount_ = with_mount_ || reading.mount != 1;
      with_level_ = with_level_ || reading.level.of_all() != 1.0;
      for (const auto& [name, level] : reading.level.of_parts()) {
        parts_.insert(name);
      }
      with_temperature_ = with_temperature_ || reading.temperature.has_value();
      with_confirm_ = with_confirm_ || reading.confirm;
      if (reading.temperature) {
        own_temperatures_ = std::max(own_temperatures_, reading.temperature->of_axes().size());
      }
    }
  }

  void show_level() { with_level_ = true; }

  [[nodiscard]] std::vector<std::string> header() const {
    std::vector<std::string> cells = {"run", "block"};
    if (with_point_) {
      cells.insert(cells.end(), {"rest", "fence"});
    }
    if (with_mount_) {
      cells.emplace_back("mount");
    }
    if (with_level_) {
      cells.emplace_back("level");
    }
    for (const std::string& part : parts_) {
      cells.push_back(level_column_prefix + part);
    }
    if (with_confirm_) {
      cells.emplace_back("confirm");
    }
    if (own_temperatures_ > 0) {
      for (const std::string& axis : axes_) {
        cells.push_back(axis + "_temperature");
      }
    } else if (with_temperature_) {
      cells.emplace_back("temperature");
    }
    return cells;
  }

  [[nodiscard]] std::vector<std::string> cells(const Reading& reading) const {
    std::vector<std::string> cells = {std::to_string(reading.run), std::to_string(reading.block)};
    if (with_point_) {  // a reading without a design point gets empty cells
      cells.emplace_back(reading.point ? face_name(reading.point->rest()) : "");
      cells.emplace_back(reading.point ? face_name(reading.point->fence()) : "");
    }
    if (with_mount_) {
      cells.push_back(std::to_string(reading.mount));
    }
    if (with_level_) {
      cells.push_back(number_text(reading.level.of_all()));
    }
    for (const std::string& part : parts_) {
      cells.push_back(number_text(reading.level.of(part)));
    }
    if (with_confirm_) {
      cells.emplace_back(reading.confirm ? "1" : "0");
    }
    for (std::size_t k = 0; own_temperatures_ > 0 && k < axes_.size(); ++k) {
      cells.push_back(reading.temperature
                          ? number_text(reading.temperature->of(static_cast<Eigen::Index>(k)))
                          : "");
    }
    if (with_temperature_ && own_temperatures_ == 0) {
      cells.push_back(reading.temperature ? number_text(reading.temperature->mean()) : "");
    }
    return cells;
  }

 private:
  bool with_point_ = false;
  bool with_mount_ = false;
  bool with_level_ = false;
  bool with_temperature_ = false;
  bool with_confirm_ = false;
  std::size_t own_temperatures_ = 0;  // number of axes with their own sensor; 0: a shared sensor
  std::vector<std::string> axes_;
  std::set<std::string> parts_;  // names of the field's parts that have their own level
};

}  // namespace axiscal
