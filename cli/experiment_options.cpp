// SPDX-License-Identifier: Apache-2.0
#include "experiment_options.hpp"

#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "input.hpp"

namespace axiscal::cli {
namespace {

void set_instrument(const ExperimentOptions& options, Instrument& instrument) {
  if (options.instrument) {
    instrument.kind = *options.instrument;
  }
  if (instrument.kind.empty()) {
    throw UsageError(
        "the kind of instrument is missing: --instrument accelerometer, inclinometer "
        "or generic");
  }
  try {
    static_cast<void>(find_instrument_kind(instrument.kind));
  } catch (const DomainError& error) {
    throw UsageError(std::string("--instrument: ") + error.what());
  }
  instrument.serial = options.serial.value_or(instrument.serial);
  instrument.unit = options.unit.value_or(instrument.unit);
  if (options.axes) {
    instrument.axes.clear();
    for (const std::string_view name : split(*options.axes, ',')) {
      if (name.empty() || name.find('=') != std::string_view::npos) {
        throw UsageError("--axes: '" + *options.axes +
                         "' must be names of columns parted by commas; this version makes no axis "
                         "of two columns");
      }
      instrument.axes.emplace_back(name);
    }
  }
  if (options.convention) {
    try {
      instrument.convention = parse_convention(*options.convention);
    } catch (const DomainError& error) {
      throw UsageError(std::string("--convention: ") + error.what());
    }
  }
}

void set_field(const ExperimentOptions& options, FieldSetup& field) {
  field.kind = options.field.value_or(field.kind);
  field.unit = options.field_unit.value_or(field.unit);
  if (options.field_magnitude) {
    field.magnitude = number_of("--field-magnitude", *options.field_magnitude);
  }
  if (options.field_table) {
    const std::vector<double> v = numbers_of("--field-table", *options.field_table, 3);
    field.in_table = Eigen::Vector3d(v[0], v[1], v[2]);
  }
  if ((options.longitude || options.height) && !options.latitude && !field.site) {
    throw UsageError("a site needs its --latitude");
  }
  if (options.latitude || options.longitude || options.height) {
    Site site = field.site.value_or(Site{});
    if (options.latitude) {
      site.latitude_deg = number_of("--latitude", *options.latitude);
    }
    if (options.longitude) {
      site.longitude_deg = number_of("--longitude", *options.longitude);
    }
    if (options.height) {
      site.height_m = number_of("--height", *options.height);
    }
    try {
      check_site(site);
    } catch (const DomainError& error) {
      throw UsageError(error.what());
    }
    field.site = site;
  }
  if (options.date) {
    if (!parse_number(*options.date) && !parse_timestamp(*options.date)) {
      throw UsageError("--date: '" + *options.date + "' is neither ISO 8601 nor a decimal year");
    }
    field.date = *options.date;
  }
}

void set_method(const ExperimentOptions& options, Experiment& experiment) {
  if (options.method) {
    experiment.method = method_of_option(*options.method);
  }
  if (options.weights) {
    experiment.weighting = parse_weighting(*options.weights);
    if (!experiment.weighting) {
      throw UsageError("--weights: must be samples, sd or none, not '" + *options.weights + "'");
    }
  }
  experiment.robust = experiment.robust || options.robust;
  if (options.leave_out) {
    experiment.leave_out.clear();
    for (const std::string_view run : split(*options.leave_out, ',')) {
      const std::optional<int> number = parse_integer(run);
      if (!number) {
        throw UsageError("--leave-out: '" + *options.leave_out +
                         "' must be run numbers parted by commas");
      }
      experiment.leave_out.push_back(*number);
    }
  }
  if (options.level_by) {
    experiment.level_by = level_by_of_option(*options.level_by);
  }
  if (options.temperature_order.value_or("0") != "0") {
    throw UsageError("--temperature-order: '" + *options.temperature_order +
                     "' is not known to this version; it knows 0");
  }
}

}  // namespace

Experiment make_experiment(const ExperimentOptions& options) {
  Experiment experiment;
  if (options.files.size() == 1 && options.files.front().ends_with(".json")) {
    experiment = read_experiment(options.files.front());
    if (experiment.observations.empty()) {
      throw UsageError(options.files.front() + " names no observations");
    }
  } else {
    experiment.observations = options.files;
    for (const std::string& file : options.files) {
      if (file.ends_with(".json")) {
        throw UsageError("'" + file + "' is an experiment and must be the only file");
      }
    }
  }
  set_instrument(options, experiment.instrument);
  set_field(options, experiment.field);
  if (options.fence_azimuth) {
    experiment.fence_azimuth_rad =
        number_of("--fence-azimuth", *options.fence_azimuth) * rad_per_deg;
  }
  if (options.slope) {
    experiment.slope = slope_of_option(*options.slope);
  }
  if (options.positioner) {
    experiment.positioner = read_positioner(*options.positioner);
  }
  experiment.slot = options.slot.value_or(experiment.slot);
  set_method(options, experiment);
  static_cast<void>(make_field_description(experiment));  // complains before any data are read
  return experiment;
}

}  // namespace axiscal::cli
