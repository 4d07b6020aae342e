// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/experiment_json.hpp"

#include <array>
#include <filesystem>
#include <functional>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/positioner/positioner_json.hpp"

namespace axiscal {
namespace {

using Keys = std::vector<std::string_view>;

// Keys of the format that this version cannot use are known, so that they are not called typing
// errors, and refused, so that they are not passed over.
void check_keys(const JsonValue& object, const Keys& usable, const Keys& later) {
  for (const std::string_view key : later) {
    if (const auto value = object.find(key)) {
      value->fail("this version of axiscal cannot use this key");
    }
  }
  Keys all = usable;
  all.insert(all.end(), later.begin(), later.end());
  object.allow_keys(all);
}

void with(const JsonValue& object,
          std::string_view key,
          const std::function<void(const JsonValue&)>& use) {
  if (const auto value = object.find(key)) {
    use(*value);
  }
}

std::string resolved(const std::string& name, const std::string& experiment_path) {
  const std::filesystem::path path(name);
  if (path.is_absolute() || name == "-") {
    return name;
  }
  return (std::filesystem::path(experiment_path).parent_path() / path).string();
}

void read_instrument(const JsonValue& json, Instrument& instrument) {
  check_keys(json, {"kind", "serial", "model", "axes", "unit", "convention", "range", "one_sided"},
             {});
  with(json, "kind", [&](const JsonValue& kind) {
    instrument.kind = kind.text();
    kind.check([&] { static_cast<void>(find_instrument_kind(instrument.kind)); });
  });
  with(json, "model", [&](const JsonValue& model) { instrument.model = model.text(); });
  with(json, "serial", [&](const JsonValue& serial) {
    instrument.serial = serial.text();
    serial.check([&] { check_serial(instrument.serial); });
  });
  with(json, "axes",
       [&](const JsonValue& axes) { axes.check([&] { set_axes(instrument, axes.texts()); }); });
  with(json, "unit", [&](const JsonValue& unit) { instrument.unit = unit.text(); });
  with(json, "convention", [&](const JsonValue& convention) {
    convention.check([&] { instrument.convention = parse_convention(convention.text()); });
  });
  with(json, "range", [&](const JsonValue& range) {
    const Eigen::VectorXd ends = range.vector(2);
    if (!(ends(0) < ends(1))) {
      range.fail("must be [low, high], low less than high");
    }
    instrument.range = ReadingRange{.low = ends(0), .high = ends(1)};
  });
  with(json, "one_sided", [&](const JsonValue& value) { instrument.one_sided = value.boolean(); });
}

template <typename Enum>
Enum choice(const JsonValue& value,
            std::optional<Enum> (*parse)(std::string_view),
            const char* names) {
  const std::optional<Enum> parsed = parse(value.text());
  if (!parsed) {
    value.fail(formatted("'{}' is not known to this version; known: {}", value.text(), names));
  }
  return *parsed;
}

Coil coil_of(const JsonValue& json) {
  check_keys(json, {"shape", "turns", "current_A", "size_m", "axis_in_table"}, {});
  Coil coil;
  with(json, "shape", [&](const JsonValue& shape) {
    coil.shape = choice(shape, parse_coil_shape, "helmholtz, merritt");
  });
  coil.turns = json.at("turns").number();
  coil.current_A = json.at("current_A").number();
  coil.size_m = json.at("size_m").number();
  with(json, "axis_in_table", [&](const JsonValue& axis) { coil.axis_in_table = axis.vector(3); });
  json.check([&] { static_cast<void>(coil_field_in_table_T(coil)); });
  return coil;
}

std::vector<Lamp> lamps_of(const JsonValue& json) {
  std::vector<Lamp> lamps;
  for (const JsonValue& one : json.elements()) {
    check_keys(one, {"direction_in_table", "irradiance"}, {});
    Lamp lamp;
    lamp.direction_in_table = one.at("direction_in_table").vector(3);
    with(one, "irradiance", [&](const JsonValue& value) { lamp.irradiance = value.number(); });
    lamps.push_back(lamp);
  }
  json.check([&] { static_cast<void>(lamps_in_table(lamps)); });
  return lamps;
}

void read_field_part(const JsonValue& json, FieldPart& field) {
  check_keys(json,
             {"kind", "role", "unit", "magnitude", "magnitude_u", "in_table", "model", "coil",
              "lamps", "source", "refraction"},
             {});
  with(json, "kind", [&](const JsonValue& kind) {
    field.kind = kind.text();
    kind.check([&] { check_field_kind(field.kind); });
  });
  with(json, "role",
       [&](const JsonValue& role) { field.role = choice(role, parse_role, "local, induced"); });
  with(json, "unit", [&](const JsonValue& unit) {
    field.unit = unit.text();
    unit.check([&] { check_field_unit(field.kind, field.unit); });
  });
  with(json, "magnitude", [&](const JsonValue& value) {
    field.magnitude = value.number();
    if (!(*field.magnitude > 0.0)) {
      value.fail("must be positive");
    }
  });
  with(json, "magnitude_u", [&](const JsonValue& value) {
    field.magnitude_u = value.number();
    if (!(field.magnitude_u >= 0.0)) {
      value.fail("must not be negative");
    }
  });
  with(json, "in_table", [&](const JsonValue& value) {
    field.in_table = value.vector(3);
    if (!(field.in_table->norm() > 0.0 && field.in_table->norm() < 1e150)) {
      value.fail("must not be zero, and shorter than 1e150");
    }
  });
  with(json, "model", [&](const JsonValue& model) { field.model = model.text(); });
  with(json, "coil", [&](const JsonValue& coil) { field.coil = coil_of(coil); });
  with(json, "lamps", [&](const JsonValue& lamps) { field.lamps = lamps_of(lamps); });
  with(json, "source", [&](const JsonValue& source) {
    if (source.text() != "sun" && source.text() != "lamp") {
      source.fail("must be sun or lamp");
    }
    field.sun = source.text() == "sun";
  });
  with(json, "refraction", [&](const JsonValue& value) { field.refraction = value.boolean(); });
}

void read_field(const JsonValue& json, FieldSetup& field) {
  if (!json.is_array()) {
    read_field_part(json, field);
    return;
  }
  const std::vector<JsonValue> parts = json.elements();
  if (parts.empty()) {
    json.fail("must have one part or more");
  }
  read_field_part(parts.front(), field);
  for (std::size_t i = 1; i < parts.size(); ++i) {
    read_field_part(parts[i], field.others.emplace_back());
  }
}

void read_one_also(const JsonValue& json, std::vector<FieldPart>& also) {
  if (json.is_text()) {
    json.check([&] { check_field_kind(json.text()); });
    also.emplace_back().kind = json.text();
  } else {
    read_field_part(json, also.emplace_back());
  }
}

void read_also(const JsonValue& json, std::vector<FieldPart>& also) {
  if (!json.is_array()) {
    read_one_also(json, also);
    return;
  }
  for (const JsonValue& one : json.elements()) {
    read_one_also(one, also);
  }
}

void read_site(const JsonValue& json, FieldSetup& field) {
  check_keys(json, {"latitude_deg", "longitude_deg", "height_m", "date"}, {});
  with(json, "date", [&](const JsonValue& date) {
    field.date = date.is_text() ? date.text() : number_text(date.number());
    if (!parse_date(field.date)) {
      date.fail("is neither ISO 8601 nor a decimal year");
    }
  });
  if (!json.find("latitude_deg") && !json.find("longitude_deg") && !json.find("height_m")) {
    return;
  }
  Site site{.latitude_deg = json.at("latitude_deg").number()};
  field.has_longitude = json.find("longitude_deg").has_value();
  with(json, "longitude_deg", [&](const JsonValue& v) { site.longitude_deg = v.number(); });
  with(json, "height_m", [&](const JsonValue& v) { site.height_m = v.number(); });
  json.check([&] { check_site(site); });
  field.site = site;
}

void read_table(const JsonValue& json, Experiment& experiment) {
  check_keys(json, {"fence_azimuth_deg", "slope"}, {});
  with(json, "fence_azimuth_deg", [&](const JsonValue& value) {
    experiment.fence_azimuth_rad = value.number() * rad_per_deg;
  });
  with(json, "slope", [&](const JsonValue& value) {
    experiment.slope = value.vector(2);
    if (!(experiment.slope.norm() < 1.0)) {
      value.fail("X^2 + Y^2 must be less than 1");
    }
  });
}

}  // namespace

Experiment parse_experiment(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-experiment");
  check_keys(json,
             {"format",    "version",    "observations", "instrument",  "field",       "site",
              "table",     "positioner", "slot",         "method",      "weights",     "robust",
              "leave_out", "level_by",   "drift",        "seats",       "temperature", "also",
              "shape",     "from",       "uncertainty",  "noise_ratio", "limits"},
             {});
  Experiment experiment;
  with(json, "observations", [&](const JsonValue& files) {
    const std::vector<std::string> names =
        files.is_array() ? files.texts() : std::vector<std::string>{files.text()};
    for (const std::string& name : names) {
      experiment.observations.push_back(resolved(name, path));
    }
  });
  with(json, "instrument",
       [&](const JsonValue& value) { read_instrument(value, experiment.instrument); });
  with(json, "field", [&](const JsonValue& value) { read_field(value, experiment.field); });
  with(json, "also", [&](const JsonValue& value) { read_also(value, experiment.also); });
  with(json, "shape", [&](const JsonValue& value) {
    experiment.shape = choice(value, parse_shape, "symmetric, triangular");
  });
  with(json, "site", [&](const JsonValue& value) { read_site(value, experiment.field); });
  with(json, "table", [&](const JsonValue& value) { read_table(value, experiment); });
  with(json, "positioner", [&](const JsonValue& value) {
    experiment.positioner = read_positioner(resolved(value.text(), path));
  });
  with(json, "slot", [&](const JsonValue& value) { experiment.slot = value.text(); });
  with(json, "method", [&](const JsonValue& value) {
    experiment.method = choice(value, parse_chosen_method, "paired, joint, known, magnitude, bias");
  });
  with(json, "weights", [&](const JsonValue& value) {
    experiment.weighting = choice(value, parse_weighting, "samples, sd, none");
  });
  with(json, "robust", [&](const JsonValue& value) {
    experiment.robust = value.is_text() ? true : value.boolean();
    if (value.is_text() && value.text() != "bisquare") {
      value.fail("must be true, false or \"bisquare\"");
    }
  });
  with(json, "noise_ratio", [&](const JsonValue& ratio) {
    experiment.noise_ratio = ratio.vector(static_cast<Eigen::Index>(ratio.elements().size()));
  });
  with(json, "leave_out", [&](const JsonValue& runs) {
    for (const JsonValue& run : runs.elements()) {
      experiment.leave_out.push_back(run.integer());
    }
  });
  with(json, "drift", [&](const JsonValue& value) {
    experiment.drift = choice(value, parse_drift, "auto, none, linear");
  });
  with(json, "seats", [&](const JsonValue& value) {
    experiment.seats = choice(value, parse_seats, "auto, fit, none");
  });
  with(json, "level_by", [&](const JsonValue& value) {
    experiment.level_by = choice(value, parse_level_by, "run, block");
  });
  with(json, "temperature", [&](const JsonValue& temperature) {
    check_keys(temperature, {"order", "reference"}, {});
    TemperatureSetup& setup = experiment.temperature;
    with(temperature, "order", [&](const JsonValue& order) {
      setup.automatic = order.is_text() && order.text() == "auto";
      if (!setup.automatic && (order.is_text() || order.integer() < 0)) {
        order.fail("must be 0, 1, 2 or \"auto\"");
      }
      setup.order = setup.automatic ? 0 : order.integer();
      setup.ignored = !setup.automatic && setup.order == 0;
    });
    with(temperature, "reference",
         [&](const JsonValue& reference) { setup.reference = reference.number(); });
  });
  with(json, "uncertainty", [&](const JsonValue& value) {
    check_keys(value, {"resolution", "slope_rad", "direction_rad", "temperature"}, {});
    StatedUncertainties& stated = experiment.stated;
    const std::array<std::pair<const char*, double*>, 4> all = {
        {{"resolution", &stated.resolution},
         {"slope_rad", &stated.slope_u},
         {"direction_rad", &stated.direction_u_rad},
         {"temperature", &stated.temperature_u}}};
    for (const auto& [key, to] : all) {
      with(value, key, [to = to](const JsonValue& number) {
        *to = number.number();
        if (!(*to >= 0.0)) {
          number.fail("must not be negative");
        }
      });
    }
  });
  with(json, "limits",
       [&](const JsonValue& value) { experiment.limits = resolved(value.text(), path); });
  with(json, "from", [&](const JsonValue& value) {
    experiment.from =
        std::make_shared<const Calibration>(read_calibration(resolved(value.text(), path)));
  });
  take_usual_field(experiment);
  return experiment;
}

Experiment read_experiment(const std::string& path) {
  return parse_experiment(read_whole_file(path), path);
}

}  // namespace axiscal
