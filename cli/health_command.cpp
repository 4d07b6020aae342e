// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "acquire_command.hpp"
#include "axiscal/acquisition/health_watch.hpp"
#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"
#include "log_input.hpp"
#include "summary.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

std::string health_text(const HealthView& view, const std::string& unit) {
  std::string text = formatted("{:<7} field {:.5g} {:.5g} {:.5g} {}, residual {:.3g}",
                               view.is_still ? "still" : "moving", view.now.field_in_sensor.x(),
                               view.now.field_in_sensor.y(), view.now.field_in_sensor.z(), unit,
                               view.now.residual);
  if (view.check) {
    const InSituReading& last = view.check->readings.back();
    text += formatted("; reading {}: residual {:.3g}, limit {:.3g}{}", view.readings, last.residual,
                      last.limit, last.within ? "" : " EXCEEDED");
  }
  return text;
}

Json health_json(const HealthView& view, const Calibration& calibration) {
  Json json = {
      {"still", view.is_still},
      {"field",
       {view.now.field_in_sensor.x(), view.now.field_in_sensor.y(), view.now.field_in_sensor.z()}},
      {"residual", view.now.residual},
      {"readings", view.readings}};
  const InstrumentKind& kind = find_instrument_kind(calibration.sensor.instrument.kind);
  for (std::size_t i = 0; i < kind.derived_names.size() && !kind.derives_with_attitude; ++i) {
    json[std::string(kind.derived_names[i])] = view.now.derived.values[i];
  }
  if (view.check) {
    json["drifted"] = view.check->drifted;
    json["p_value"] = view.check->p_value;
    json["residual_rss"] = view.check->rss;
    json["expected_rss"] = view.check->expected_rss;
    json["limit"] = view.check->readings.back().limit;
  }
  return json;
}

HealthWatchSetup watch_setup(const AcquireCommand& command) {
  HealthWatchSetup setup;
  setup.calibration = in_assembly_frame(read_calibration(*command.check));
  if (command.dwell) {
    setup.dwell_s = parse_positive("--dwell", *command.dwell);
  }
  if (command.window) {
    setup.stillness.window_s = parse_positive("--window", *command.window);
  }
  if (command.temperature_column) {
    setup.temperature_channels = names_of(*command.temperature_column);
  }
  return setup;
}

}  // namespace

int run_health_check(const AcquireCommand& command) {
  const HealthWatchSetup setup = watch_setup(command);
  const Calibration& calibration = setup.calibration;
  const std::string& unit = calibration.sensor.field.unit;
  HealthRun run;
  if (command.readings) {
    run.readings = static_cast<std::size_t>(parse_whole_number("--readings", *command.readings, 1));
  }
  if (command.within) {
    run.patience_s = parse_positive("--within", *command.within);
  }
  run.show = [&](const HealthView& view) {
    print_result_text(command.json ? health_json(view, calibration).dump() + "\n"
                                   : health_text(view, unit) + "\n");
  };
  run.warn = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  SampleFeed feed(open_sources(command));
  HealthWatch watch(setup);
  const HealthView& view = [&]() -> const HealthView& {
    try {
      return run_health_watch(watch, feed, run);
    } catch (const DomainError& error) {
      throw UsageError("acquire", error);
    }
  }();
  if (command.json) {
    run.show(view);
  } else {
    print_result_text(
        formatted("{}: {} readings at rest, root sum of squares of the residuals {:.3g} {}, "
                  "expected {:.3g} (p = {})\n",
                  view.check->drifted ? "drifted" : "no drift", view.readings, view.check->rss,
                  unit, view.check->expected_rss, number_text(view.check->p_value, 2)));
  }
  return view.check->drifted ? 1 : 0;
}

}  // namespace axiscal::cli
