// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/axis_intake.hpp"

#include <cmath>

#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t saturated_samples = 3;

}  // namespace

AxisIntake::AxisIntake(const Instrument& instrument)
    : instrument_(instrument),
      values_(instrument.axis_count()),
      beyond_(static_cast<std::size_t>(instrument.axis_count()), 0) {}

void AxisIntake::set_channels(const std::vector<Channel>& channels) {
  columns_ = find_axes(instrument_, channels);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const std::string& unit = channels[columns_[k].plus].unit;
    if (!unit.empty() && unit != instrument_.unit && instrument_.unit != "1") {
      unit_text_ = formatted(
          "axis '{}' has the unit {} in the source, but {} in the experiment: correct the wrong "
          "unit",
          instrument_.axes[k], unit, instrument_.unit);
    }
  }
}

bool AxisIntake::is_beyond(double value) const {
  const std::optional<ReadingRange>& range = instrument_.range;
  return std::isinf(value) || (range && (value <= range->low || value >= range->high));
}

bool AxisIntake::take(std::span<const double> values) {
  saturated_.clear();
  missing_.clear();
  bool good = true;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const AxisColumns& columns = columns_[k];
    const double value = columns.value(values);
    values_(static_cast<Eigen::Index>(k)) = value;
    const bool beyond =
        is_beyond(values[columns.plus]) || (columns.minus && is_beyond(values[*columns.minus]));
    beyond_[k] = beyond ? beyond_[k] + 1 : 0;
    if (beyond_[k] >= saturated_samples) {
      saturated_.push_back(instrument_.axes[k]);
    }
    if (std::isnan(value) && !beyond) {
      missing_.push_back(instrument_.axes[k]);
    }
    good = good && std::isfinite(value);
  }
  return good;
}

std::string AxisIntake::saturated_text() const {
  return saturated_.empty()
             ? ""
             : joined(saturated_) + ": at the limit of the range; is the range large enough?";
}

std::string AxisIntake::missing_text() const {
  return missing_.empty() ? "" : joined(missing_) + ": the value is missing";
}

}  // namespace axiscal
