// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/noise_json.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// The noise of one sensor as Kalibr needs it, in SI units.
struct KalibrNoise {
  double density = 0.0;
  double walk = 0.0;
  bool walk_is_limit = false;  // true if an upper bound was used for at least one axis
  double rate_hz = 0.0;
};

KalibrNoise noise_of(const LogNoise& noise, SeriesKind kind) {
  KalibrNoise sum;
  double count = 0.0;
  for (const ColumnNoise& one : noise.columns) {
    if (one.kind != name_of(kind)) {
      continue;
    }
    const std::optional<KnownUnit> unit = known_unit(one.unit, kind);
    if (!unit || unit->kind != kind) {
      throw RefusedError(
          formatted("kalibr: the unit '{}' of column {} is not known; write m/s^2 or g, rad/s or "
                    "deg/s after its name in the log: \"{} (m/s^2)\"",
                    one.unit, one.name, one.name));
    }
    double density = 0.0;
    double walk = 0.0;
    for (const NoiseCoefficient& c : one.model.coefficients) {
      if (c.kind == NoiseKind::white) {
        density = c.value;
      } else if (c.kind == NoiseKind::random_walk) {
        const bool shown = c.value > 0.0;
        walk = shown ? c.value : std::isfinite(c.high) ? c.high : 0.0;
        sum.walk_is_limit = sum.walk_is_limit || !shown;
      }
    }
    sum.density += density * density * unit->si * unit->si;
    sum.walk += walk * walk * unit->si * unit->si;
    sum.rate_hz = one.rate_hz > 0.0 ? one.rate_hz : noise.rate_hz;
    count += 1.0;
  }
  if (count == 0.0) {
    throw RefusedError(
        formatted("kalibr: the columns of a sensor of the kind {} are missing; imu.yaml requires "
                  "accelerometer and gyroscope",
                  name_of(kind)));
  }
  sum.density = std::sqrt(sum.density / count);
  sum.walk = std::sqrt(sum.walk / count);
  if (!(sum.density > 0.0)) {
    throw RefusedError(formatted(
        "kalibr: the white noise of the {} could not be determined; record a longer log at "
        "rest",
        name_of(kind)));
  }
  return sum;
}

std::string lines_of(const char* name, const KalibrNoise& noise, const char* unit) {
  return formatted(
      "{}_noise_density: {}  # N [{}/sqrt(Hz)], root mean square of the axes\n"
      "{}_random_walk: {}  # K [{}/s/sqrt(Hz)]{}\n",
      name, number_text(noise.density, 6), unit, name, number_text(noise.walk, 6), unit,
      noise.walk_is_limit ? ", an upper bound, because the log is too short to determine the value "
                            "on every axis"
                          : "");
}

}  // namespace

std::string kalibr_imu_yaml(const LogNoise& noise, const std::string& topic) {
  const KalibrNoise accelerometer = noise_of(noise, SeriesKind::accelerometer);
  const KalibrNoise gyroscope = noise_of(noise, SeriesKind::gyroscope);
  return formatted(
      "# For the calibration of cameras with an IMU by Kalibr; set rostopic to your topic.\n"
      "# From a log at rest. Kalibr's authors advise increasing both values by a factor of up\n"
      "# to 10 for a sensor that shakes or warms up.\n"
      "{}{}rostopic: {}\n"
      "update_rate: {}  # Hz\n",
      lines_of("accelerometer", accelerometer, "m/s^2"), lines_of("gyroscope", gyroscope, "rad/s"),
      topic, number_text(gyroscope.rate_hz, 6));
}

}  // namespace axiscal
