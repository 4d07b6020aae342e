// SPDX-License-Identifier: Apache-2.0
// Format iio: the attributes calibbias and calibscale of Linux IIO, with one file per axis and
// attribute (kernel.org, ABI/testing/sysfs-bus-iio).
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {

Exported export_iio(const Calibration& given, const ExportOptions& options) {
  const Sensor sensor = sensor_of(given, "iio");
  const Calibration calibration =
      sensor == Sensor::magnetometer ? with_measured_field(given) : given;
  const std::string unit = sensor == Sensor::magnetometer ? "G" : usual_unit(sensor, "G");
  const ConsumerModel model =
      nearest_model(calibration, {unit, unit}, MatrixShape::diagonal, options);
  const std::optional<ExportLoss> loss = accepted_loss(calibration, model, "iio", options);
  const std::string name = sensor == Sensor::accelerometer ? "accel"
                           : sensor == Sensor::gyroscope   ? "anglvel"
                                                           : "magn";
  std::string text = comment_lines(
      calibration, "# ",
      {formatted("corrected = calibscale (v + calibbias), v = raw * scale in {}; the unit of "
                 "calibbias depends on the driver: check the unit in your driver",
                 unit),
       "run these lines in the folder /sys/bus/iio/devices/iio:deviceN",
       worked_example(calibration, model)},
      loss);
  for (int k = 0; k < 3; ++k) {
    text +=
        formatted("echo {} > in_{}_{}_calibbias\n", number_text(-model.bias(k)), name, "xyz"[k]);
    text += formatted("echo {} > in_{}_{}_calibscale\n", number_text(model.inverse(k, k)), name,
                      "xyz"[k]);
  }
  return {.content = text, .loss = loss};
}

}  // namespace axiscal
