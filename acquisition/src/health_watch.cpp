// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/health_watch.hpp"

#include <algorithm>
#include <cmath>

#include "acquisition/src/axis_columns.hpp"
#include "acquisition/src/dwell_sums.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_readings = 1000;  // older readings are dropped, to limit the memory use

}  // namespace

class HealthWatch::Impl {
 public:
  explicit Impl(HealthWatchSetup setup)
      : setup_(std::move(setup)),
        m_(setup_.calibration.sensor.instrument.axis_count()),
        reducer_(setup_.calibration),
        stillness_(static_cast<std::size_t>(m_), setup_.stillness),
        dwell_(m_),
        x_(m_) {
    static_cast<void>(check_in_situ(setup_.calibration, of({response_of_up()}), setup_.alpha));
  }

  void set_channels(const std::vector<Channel>& channels) {
    columns_ = find_axes(setup_.calibration.sensor.instrument, channels);
    temperature_columns_ = find_temperatures(setup_.calibration.sensor.instrument, channels,
                                             setup_.temperature_channels);
  }

  void add(double time_s, std::span<const double> values) {
    bool good = true;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      const double value = columns_[k].value(values);
      x_(static_cast<Eigen::Index>(k)) = value;
      good = good && std::isfinite(value) && !reducer_.is_saturated(value);
    }
    if (!good) {
      stillness_.restart();
      dwell_.clear();
      return;
    }
    if (const std::optional<SensorTemperature> now = temperature_in(values, temperature_columns_)) {
      temperature_ = now;
    }
    stillness_.add(time_s, {x_.data(), static_cast<std::size_t>(m_)});
    if (!stillness_.is_still()) {
      dwell_.clear();
      return;
    }
    dwell_.add(time_s, x_);
    if (dwell_.seconds() >= setup_.dwell_s && dwell_.samples() >= fewest_samples_of_dwell) {
      stillness_.learn(dwell_.sd());
      means_.push_back({.mean = dwell_.mean(), .temperature = temperature_});
      if (means_.size() > most_readings) {
        means_.erase(means_.begin());
      }
      view_.check = check_in_situ(setup_.calibration, of(means_), setup_.alpha);
      dwell_.clear();
    }
  }

  const HealthView& view() {
    view_.is_still = stillness_.is_still();
    view_.progress = std::clamp(dwell_.seconds() / setup_.dwell_s, 0.0, 1.0);
    view_.readings = means_.size();
    const Eigen::VectorXd mean = stillness_.mean();
    view_.now =
        reducer_.reduce({mean.data(), static_cast<std::size_t>(m_)}, {.temperature = temperature_});
    return view_;
  }

 private:
  struct Mean {
    Eigen::VectorXd mean;
    std::optional<SensorTemperature> temperature;
  };

  // Returns the predicted reading in a field along z. The constructor checks this reading, so that
  // an unsuitable record is reported at once.
  [[nodiscard]] Mean response_of_up() const {
    return {.mean = setup_.calibration.sensor.response.at(
                setup_.calibration.sensor.field.magnitude * Eigen::Vector3d::UnitZ()),
            .temperature = {}};
  }

  [[nodiscard]] Observations of(const std::vector<Mean>& means) const {
    Observations observations;
    observations.response = Eigen::MatrixXd(static_cast<Eigen::Index>(means.size()), m_);
    for (std::size_t i = 0; i < means.size(); ++i) {
      Reading reading;
      reading.run = static_cast<int>(i) + 1;
      reading.temperature = means[i].temperature;
      observations.readings.push_back(reading);
      observations.response.row(static_cast<Eigen::Index>(i)) = means[i].mean.transpose();
    }
    return observations;
  }

  HealthWatchSetup setup_;
  Eigen::Index m_;
  Reducer reducer_;
  Stillness stillness_;
  DwellSums dwell_;
  Eigen::VectorXd x_;
  std::vector<AxisColumns> columns_;
  std::vector<std::size_t> temperature_columns_;
  std::optional<SensorTemperature> temperature_;
  std::vector<Mean> means_;
  HealthView view_;
};

HealthWatch::HealthWatch(HealthWatchSetup setup)
    : impl_(std::make_unique<Impl>(std::move(setup))) {}
HealthWatch::~HealthWatch() = default;

void HealthWatch::set_channels(const std::vector<Channel>& channels) {
  impl_->set_channels(channels);
}
void HealthWatch::add(double time_s, std::span<const double> values) {
  impl_->add(time_s, values);
}
const HealthView& HealthWatch::view() {
  return impl_->view();
}

}  // namespace axiscal
