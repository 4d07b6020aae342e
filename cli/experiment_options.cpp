// SPDX-License-Identifier: Apache-2.0
#include "experiment_options.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/experiment_json.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/field/recorded_field.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "core/formatted.hpp"
#include "typed_values.hpp"

namespace axiscal::cli {
namespace {

void set_instrument(const ExperimentOptions& options, Instrument& instrument) {
  if (options.instrument) {
    instrument.kind = *options.instrument;
  }
  if (instrument.kind.empty()) {
    throw UsageError(
        "the kind of instrument is missing: give --instrument accelerometer, inclinometer, "
        "magnetometer, gyroscope, optical or generic");
  }
  try {
    static_cast<void>(find_instrument_kind(instrument.kind));
  } catch (const DomainError& error) {
    throw UsageError("--instrument", error);
  }
  instrument.model = options.model.value_or(instrument.model);
  if (options.serial) {
    try {
      check_serial(*options.serial);
    } catch (const DomainError& error) {
      throw UsageError("--serial", error);
    }
    instrument.serial = *options.serial;
  }
  instrument.unit = options.unit.value_or(instrument.unit);
  if (options.axes) {
    std::vector<std::string> texts;
    for (const std::string_view text : split(*options.axes, ',')) {
      texts.emplace_back(text);
    }
    try {
      set_axes(instrument, texts);
    } catch (const DomainError& error) {
      throw UsageError(formatted("--axes: '{}'", *options.axes), error);
    }
  }
  if (options.range) {
    instrument.range = range_of("--range", *options.range);
  }
  instrument.one_sided = instrument.one_sided || options.one_sided;
  if (options.convention) {
    try {
      instrument.convention = parse_convention(*options.convention);
    } catch (const DomainError& error) {
      throw UsageError("--convention", error);
    }
  }
}

// Returns the part of a field to which the options for magnitude, vector and source apply. In a sum
// of fields, this is the induced part. If no part is induced, it is the first part.
FieldSetup& stated_part(FieldSetup& field) {
  for (FieldSetup& part : field.others) {
    if (!field.is_induced() && part.is_induced()) {
      return part;
    }
  }
  return field;
}

// Parses one part of --field: KIND, KIND:ROLE or NAME=KIND:ROLE.
FieldSetup part_of(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::size_t after_name = equals == std::string_view::npos ? 0 : equals + 1;
  const std::size_t parting = text.find(':', after_name);
  FieldSetup part(make_field(text.substr(after_name, parting - after_name)));
  if (after_name > 0) {
    part.name = text.substr(0, equals);
  }
  if (parting != std::string_view::npos) {
    part.role = parse_role(text.substr(parting + 1));
    if (!part.role) {
      throw UsageError(formatted("--field: '{}': the role must be 'local' or 'induced'", text));
    }
  }
  return part;
}

// Copies kind, name and role of `part` to `field`. Other properties of `field` do not change.
void take_kind(FieldSetup part, FieldSetup& field) {
  field.of = std::move(part.of);
  field.name = std::move(part.name);
  field.role = part.role;
}

void set_kinds(const std::string& text, FieldSetup& field) {
  if (text.ends_with(".json")) {
    field = read_field(text);
    return;
  }
  field.others.clear();
  const std::vector<std::string_view> kinds = split(text, '+');
  take_kind(part_of(kinds.front()), field);
  for (std::size_t i = 1; i < kinds.size(); ++i) {
    field.others.push_back(part_of(kinds[i]));
  }
}

// Splits a text A+B into values, and calls `set` with each value and its part of the field. A text
// with a single value applies to stated_part(). Empty values are skipped.
void for_each_part(const char* option,
                   const std::string& text,
                   FieldSetup& field,
                   const std::function<void(const std::string& value, FieldSetup& part)>& set) {
  if (field.others.empty()) {
    set(text, field);
    return;
  }
  // A plus sign separates values, but it may also be the sign of a number or of its exponent.
  std::vector<std::string> values(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool ends_value = i > 0 && (std::isdigit(static_cast<unsigned char>(text[i - 1])) != 0 ||
                                      text[i - 1] == '.' || values.back() == "unknown");
    if (text[i] == '+' && (ends_value || values.back().empty())) {
      values.emplace_back();
    } else {
      values.back() += text[i];
    }
  }
  if (values.size() == 1) {
    set(text, stated_part(field));
    return;
  }
  if (values.size() != 1 + field.others.size()) {
    throw UsageError(formatted("{}: '{}' has {} values, but the field has {} parts", option, text,
                               values.size(), 1 + field.others.size()));
  }
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (!values[p].empty()) {
      set(values[p], *field.parts()[p]);
    }
  }
}

void set_models(const ExperimentOptions& options, FieldSetup& part) {
  const FieldKind& kind = field_kind(part.kind());
  const std::optional<std::string>& model = kind.dated      ? options.magnetic_model
                                            : kind.vertical ? options.gravity_model
                                                            : std::optional<std::string>();
  if (model) {
    part.of = make_field(kind.name, {{"model", *model}});
  }
}

void set_source(const std::string& source, FieldSetup& part) {
  if (source != "sun" && source != "lamp") {
    throw UsageError(formatted("--source: must be 'sun' or 'lamp', not '{}'", source));
  }
  if (part.kind() != "light") {
    throw UsageError("--source: requires --field light");
  }
  part.of = make_field(part.kind(), {{"source", source}});
}

void set_magnitude(const std::string& value, FieldSetup& part) {
  part.magnitude_unknown = value == "unknown";
  part.magnitude.reset();
  if (!part.magnitude_unknown) {
    part.magnitude = number_of("--field-magnitude", value);
  }
}

// Applies the option --field-table. Its value is a vector X,Y,Z, or a FILE.csv with the field over
// time.
void set_in_table(const std::string& value, FieldSetup& part) {
  if (value.ends_with(".csv") && part.of) {
    part.of = std::make_shared<const RecordedField>(read_recorded_field(value, part.of));
    return;
  }
  const std::vector<double> v = numbers_of("--field-table", value, 3);
  part.in_table = Eigen::Vector3d(v[0], v[1], v[2]);
}

void set_field(const ExperimentOptions& options,
               const Instrument& instrument,
               const TablePlace& place,
               FieldSetup& field) {
  if (options.field) {
    set_kinds(*options.field, field);
  }
  if (options.field_unit) {
    for (FieldSetup* const part : field.parts()) {
      part->unit = *options.field_unit;
    }
  }
  if (options.field_magnitude) {
    for_each_part("--field-magnitude", *options.field_magnitude, field, set_magnitude);
  }
  if (options.field_magnitude_u) {
    for_each_part("--field-magnitude-u", *options.field_magnitude_u, field,
                  [](const std::string& value, FieldSetup& part) {
                    part.magnitude_u = parse_nonnegative("--field-magnitude-u", value);
                  });
  }
  const bool by_file = options.field_table && options.field_table->ends_with(".csv");
  if (options.field_table && !by_file) {
    for_each_part("--field-table", *options.field_table, field, set_in_table);
  }
  set_default_field(instrument, place, field);
  if (by_file) {
    for_each_part("--field-table", *options.field_table, field, set_in_table);
  }
  if (options.source) {
    set_source(*options.source, stated_part(field));
  }
  for (FieldSetup* const part : field.parts()) {
    set_models(options, *part);
  }
}

void set_place(const ExperimentOptions& options, TablePlace& place) {
  if ((options.longitude || options.height) && !options.latitude && !place.site) {
    throw UsageError("--longitude and --height require --latitude");
  }
  if (options.latitude || options.longitude || options.height) {
    place.has_longitude = options.longitude || (place.site && place.has_longitude);
    place.site = site_of_options(options.latitude, options.longitude, options.height,
                                 place.site.value_or(Site{}));
  }
  if (options.date) {
    static_cast<void>(date_of_option(*options.date));
    place.date = *options.date;
  }
}

void set_method(const ExperimentOptions& options, Experiment& experiment) {
  if (options.method) {
    experiment.fit.method = method_of_option(*options.method);
  }
  if (options.shape) {
    const std::optional<MagnitudeShape> shape = parse_shape(*options.shape);
    if (!shape) {
      throw UsageError(
          formatted("--shape: must be 'symmetric' or 'triangular', not '{}'", *options.shape));
    }
    experiment.fit.shape = *shape;
  }
  if (options.weights) {
    experiment.fit.weighting = parse_weighting(*options.weights);
    if (!experiment.fit.weighting) {
      throw UsageError(
          formatted("--weights: must be 'samples', 'sd' or 'none', not '{}'", *options.weights));
    }
  }
  experiment.fit.robust = experiment.fit.robust || options.robust;
  experiment.fit.squares = experiment.fit.squares || options.squares;
  experiment.fit.compare_polar_fit = experiment.fit.compare_polar_fit || options.polar_fit;
  if (options.leave_out) {
    experiment.leave_out.clear();
    for (const std::string_view run : split(*options.leave_out, ',')) {
      const std::optional<int> number = parse_integer(run);
      if (!number) {
        throw UsageError(formatted("--leave-out: '{}' must be run numbers separated by commas",
                                   *options.leave_out));
      }
      experiment.leave_out.push_back(*number);
    }
  }
  if (options.noise_ratio) {
    const std::vector<double> ratio =
        numbers_of("--noise-ratio", *options.noise_ratio, experiment.instrument.axes.size());
    experiment.fit.noise_ratio =
        Eigen::Map<const Eigen::VectorXd>(ratio.data(), static_cast<Eigen::Index>(ratio.size()));
  }
  if (options.drift) {
    experiment.fit.drift = drift_of_option(*options.drift);
  }
  if (options.seats) {
    experiment.fit.seats = seats_of_option(*options.seats);
  }
  if (options.level_by) {
    experiment.fit.level_by = levelness_scope_of_option(*options.level_by);
  }
}

void set_temperature(const ExperimentOptions& options, Experiment& experiment) {
  TemperatureSetup& setup = experiment.fit.temperature;
  if (options.temperature_order) {
    setup.automatic = *options.temperature_order == "auto";
    const std::optional<int> order =
        setup.automatic ? std::optional(0) : parse_integer(*options.temperature_order);
    if (!order || *order < 0) {
      throw UsageError(formatted("--temperature-order: must be 0, 1, 2 or 'auto', not '{}'",
                                 *options.temperature_order));
    }
    setup.order = *order;
    setup.ignored = !setup.automatic && *order == 0;
  }
  if (options.temperature_reference) {
    setup.reference = number_of("--temperature-reference", *options.temperature_reference);
  }
  if (options.from) {
    experiment.from = std::make_shared<const Calibration>(read_calibration(*options.from));
  }
  if (experiment.from && method_kind(experiment.fit.method).fits_sensitivity) {
    throw UsageError("--from: requires --method bias or --method attitude");
  }
}

void set_stated_uncertainties(const ExperimentOptions& options, StatedUncertainties& stated) {
  const auto set = [](const char* option, const std::optional<std::string>& text, double& to) {
    if (text) {
      to = parse_nonnegative(option, *text);
    }
  };
  set("--resolution", options.resolution, stated.resolution);
  set("--slope-u", options.slope_u, stated.slope_u);
  set("--direction-u", options.direction_u, stated.direction_u_rad);
  set("--temperature-u", options.temperature_u, stated.temperature_u);
  set("--reference-u", options.reference_u, stated.reference_u);
}

}  // namespace

void add_files(OptionSet& options, ExperimentOptions& experiment, Need need) {
  options.add("files", experiment.files, "FILE",
              "readings (CSV), or one experiment (.json); several files are the blocks of one run; "
              "- is stdin",
              need);
}

void add_experiment_options(OptionSet& options, ExperimentOptions& experiment) {
  OptionSet instrument = options.group("Instrument");
  instrument.add(
      "--instrument", experiment.instrument, "KIND",
      "accelerometer, inclinometer, magnetometer, gyroscope, optical or generic; or a FILE.json "
      "with a kind of your own. L=KIND,M=KIND gives the kinds of several slots (columns "
      "SLOT.axis); --axes, --unit, --field and others then also accept L=..,M=..");
  instrument.add("--serial", experiment.serial, "TEXT", "serial number");
  instrument.add("--model", experiment.model, "TEXT", "model name, which several units share");
  instrument.add("--axes", experiment.axes, "A,B,..",
                 "columns of the readings, one for each axis; d=p-n defines an axis d whose "
                 "readings are column p minus column n [default: x,y,z]");
  instrument.add("--range", experiment.range, "LO,HI",
                 "a reading at or beyond these limits is saturated; it is left out for this axis");
  instrument.add_flag("--one-sided", experiment.one_sided,
                      "each axis responds only to light from its front side (photodiodes)");
  instrument.add("--unit", experiment.unit, "UNIT", "unit of the readings [default: 1]");
  instrument.add(
      "--nominal-sensitivity", experiment.nominal_sensitivity, "S",
      "nominal sensitivities of the axes, to detect a mistake that changes all readings of a run "
      "in the same way");
  instrument.add(
      "--convention", experiment.convention, "flu|frd",
      "directions of x, y, z: forward-left-up (flu) or forward-right-down (frd) [default: flu]");
  OptionSet field = options.group("Field");
  field.add("--field", experiment.field, "KIND",
            "gravity, geomagnetic, earth_rotation, induced_rotation, induced_magnetic, light or "
            "custom; or a FILE.json with the field. KIND+KIND is a sum; a single magnitude or "
            "vector then belongs to the induced part. KIND:induced is multiplied by the level of a "
            "reading, KIND:local is not. NAME=KIND reads the level from the column level.NAME");
  field.add("--also", experiment.also, "KIND",
            "a second known field to which the instrument responds (a gyroscope's g-sensitivity)");
  field.add("--field-unit", experiment.field_unit, "UNIT",
            "g, m/s^2, nT, uT, T, rad/s, deg/s, deg/h, 1 or W/m^2 [default: g for gravity]");
  field.add("--field-magnitude", experiment.field_magnitude, "F",
            "magnitude of the field, in the field's unit; A+B for a sum; `unknown`: the magnitude "
            "is fitted (another part of the sum must be known)");
  field.add("--field-magnitude-u", experiment.field_magnitude_u, "U",
            "standard uncertainty of --field-magnitude");
  field.add("--field-table", experiment.field_table, "X,Y,Z",
            "vector of the field in the table's frame; X,Y,Z+X,Y,Z for a sum; or a FILE.csv with "
            "this vector over time");
  field.add("--latitude", experiment.latitude, "DEG", "latitude of the site");
  field.add("--longitude", experiment.longitude, "DEG", "longitude of the site [default: 0]");
  field.add("--height", experiment.height, "M",
            "height of the site above the ellipsoid [default: 0]");
  field.add("--date", experiment.date, "DATE", "ISO 8601 or decimal year [default: today]");
  field.add("--magnetic-model", experiment.magnetic_model, "NAME",
            "magnetic model: wmm2025 (built in), or a model installed for GeographicLib");
  field.add("--gravity-model", experiment.gravity_model, "NAME",
            "gravity model: wgs84 (built in), or a model installed for GeographicLib");
  field.add(
      "--source", experiment.source, "sun|lamp",
      "source of the light; the position of the sun is computed for the time of each reading");
  OptionSet table_and_cube = options.group("Table and cube");
  table_and_cube.add("--fence-azimuth", experiment.fence_azimuth, "DEG",
                     "azimuth of the table's y axis, clockwise from north [default: 0; the method "
                     "'joint' estimates it]");
  table_and_cube.add(
      "--face-names", experiment.face_names, "WORD=FACE,..",
      "meaning of words in the columns 'rest' and 'fence', for example 'up=-Z,nose up=-X'");
  table_and_cube.add("--slope", experiment.slope, "X,Y", "known slope of the table [default: 0,0]");
  table_and_cube.add("--positioner", experiment.positioner, "FILE",
                     "file of the measured cube [default: the nominal cube]");
  table_and_cube.add("--slot", experiment.slot, "NAME",
                     "name of the mount (in the positioner file) that holds the instrument; for "
                     "`acquire` with several instruments, the names A,B,.. of their mounts");
  table_and_cube.add(
      "--assembly", experiment.assembly, "NAME",
      "orientation of the instruments in the slots (columns SLOT.axis): parallel, single, triple "
      "(axes parallel to the cube's), h or h:y (two instruments on the web of an H, the second "
      "turned by 180 degrees about x or y)");
  OptionSet method = options.group("Method");
  method.add(
      "--method", experiment.method, "METHOD",
      "paired, joint, known, faces, magnitude, bias or attitude; 'magnitude' needs no labels. The "
      "method "
      "'bias' takes readings at rest in one pose, over temperature. The method 'attitude' finds "
      "how the instrument of --from is mounted in a model [default: chosen from the readings]");
  method.add("--shape", experiment.shape, "SHAPE",
             "method 'magnitude': form of the sensitivity matrix, symmetric or triangular "
             "[default: symmetric]");
  method.add(
      "--weights", experiment.weights, "W",
      "weights of the readings: 'samples' (from the column 'samples'), 'sd' (from the columns "
      "AXIS_sd) or 'none' (equal weights) [default: 'samples' if that column exists]");
  method.add_flag("--robust", experiment.robust,
                  "robust regression (bisquare), which gives outliers small weights");
  method.add_flag(
      "--squares", experiment.squares,
      "method 'magnitude': also fit a squared term of each axis, for a nonlinear response");
  method.add_flag("--polar-fit", experiment.polar_fit,
                  "also fit the polar form of the axes (coning angle, azimuth) by Gauss-Newton, to "
                  "compare it with the linear fit");
  method.add("--leave-out", experiment.leave_out, "RUNS", "runs to leave out, for example 7,8");
  method.add("--noise-ratio", experiment.noise_ratio, "A,B,..",
             "known ratios of the noise of the axes, for example 1,1,1; with known ratios, smaller "
             "mistakes are detected");
  method.add("--drift", experiment.drift, "auto|none|linear",
             "fit a drift of the bias over the run; 'auto' fits it only if the readings show a "
             "drift [default: auto]");
  method.add("--seats", experiment.seats, "auto|fit|none",
             "fit a random rotation of the cube for each time that it is laid down; 'auto' fits it "
             "only if there are 24 readings or more [default: auto]");
  method.add("--level-by", experiment.level_by, "run|block",
             "one slope of the table for the run or one for each block [default: run]");
  method.add("--temperature-order", experiment.temperature_order, "N",
             "order of the polynomial in temperature for bias and scale: 0, 1, 2 or auto; the "
             "method 'bias' accepts any order [default: 0]");
  method.add("--temperature-reference", experiment.temperature_reference, "T",
             "temperature for which the coefficients are stated [default: mean of the readings]");
  method.add("--from", experiment.from, "RECORD",
             "record that gives the sensitivity (method 'bias') or the calibration of the "
             "instrument (method 'attitude')");
  OptionSet uncertainty = options.group("Uncertainty");
  uncertainty.add("--resolution", experiment.resolution, "Q", "smallest step of a reading");
  uncertainty.add("--slope-u", experiment.slope_u, "RAD",
                  "standard uncertainty of --slope along x and y");
  uncertainty.add("--direction-u", experiment.direction_u, "RAD",
                  "standard uncertainty of the field's stated direction");
  uncertainty.add("--temperature-u", experiment.temperature_u, "U",
                  "standard uncertainty of the temperature output");
  uncertainty.add("--reference-u", experiment.reference_u, "U",
                  "relative standard uncertainty of the voltage or current reference, for readings "
                  "in an electrical unit");
  uncertainty.add("--positioner-u", experiment.positioner_u, "RAD",
                  "standard uncertainty of each face normal of the cube");
}

std::string take_unit_of_file(const std::string& unit, ExperimentOptions& options) {
  if (options.unit || unit.empty()) {
    return "";
  }
  options.unit = unit;
  const bool is_gravity = options.field.value_or("gravity") == "gravity" &&
                          (options.instrument == "accelerometer" ||
                           options.instrument == "inclinometer" || !options.instrument);
  if (unit != "m/s^2" || !is_gravity || options.field_unit || options.field_magnitude) {
    return "";
  }
  options.field_unit = unit;
  if (options.latitude) {
    return "";
  }
  options.field_magnitude = number_text(standard_gravity);
  return formatted(
      "the readings are in m/s^2, so the magnitude of gravity is taken as the standard value, {} "
      "m/s^2, which may be wrong by up to 0.3 %; give --latitude and --height to compute the "
      "gravity at the site",
      *options.field_magnitude);
}

// Returns true for a `.json` file that is an experiment, not a table of readings. A table in JSON
// is a list, has one object per line, or is an object whose members are lists.
bool is_experiment_file(const std::string& path) {
  std::error_code none;
  if (!path.ends_with(".json")) {
    return false;
  }
  if (!std::filesystem::is_regular_file(path, none)) {
    return true;
  }
  InputFile file(path);
  std::array<char, 4096> buffer{};
  const std::string_view start(buffer.data(), file.read(buffer.data(), buffer.size()));
  const std::string_view text = trimmed(start);
  return !text.starts_with('[') && (start.find("\"axiscal-") != std::string_view::npos ||
                                    start.find("\"rest\"") == std::string_view::npos);
}

namespace {

// Returns the value of one slot from a text such as L=A,M=B. A text without names of slots applies
// to every slot and is returned whole.
std::optional<std::string> of_slot(const char* option,
                                   const std::optional<std::string>& text,
                                   const std::vector<std::string>& slots,
                                   const std::string& slot) {
  if (!text) {
    return text;
  }
  std::optional<std::string> own;
  bool any = false;
  bool in_own = false;
  const bool may_have_equals =
      std::string_view(option) == "--field" || std::string_view(option) == "--axes";
  for (const std::string_view item : split(*text, ',')) {
    const std::string_view name = trimmed(item.substr(0, item.find('=')));
    const bool is_slot = std::find(slots.begin(), slots.end(), name) != slots.end();
    const bool begins = item.find('=') != std::string_view::npos && is_slot;
    if (item.find('=') != std::string_view::npos && !is_slot && !may_have_equals) {
      throw UsageError(
          formatted("{}: '{}' is not a slot; the slots are {}", option, name, joined(slots)));
    }
    if (begins) {
      any = true;
      in_own = name == slot;
      if (in_own && own) {
        throw UsageError(formatted("{}: slot {} is given twice", option, slot));
      }
      if (in_own) {
        own = std::string(item.substr(item.find('=') + 1));
      }
    } else if (in_own && own) {
      *own += formatted(",{}", item);  // continues the list of this slot
    }
  }
  return any ? own : text;
}

// Sets the slots from --instrument L=KIND,M=KIND, and their values from the other options
// (L=..,M=..).
void set_slots(const ExperimentOptions& options, Experiment& experiment) {
  std::vector<std::string> slots;
  if (states_slots(options)) {
    experiment.slots.clear();
    for (const std::string_view item : split(*options.instrument, ',')) {
      const std::size_t equals = item.find('=');
      const std::string name(trimmed(item.substr(0, equals)));
      if (equals == std::string_view::npos || name.empty() ||
          std::find(slots.begin(), slots.end(), name) != slots.end()) {
        throw UsageError(
            formatted("--instrument: '{}': must be SLOT=KIND,SLOT=KIND, with each slot once",
                      *options.instrument));
      }
      slots.push_back(name);
      experiment.slots.push_back({.slot = name, .instrument = {}, .field = {}});
    }
  } else {
    for (const SlotSetup& slot : experiment.slots) {
      slots.push_back(slot.slot);
    }
  }
  for (SlotSetup& slot : experiment.slots) {
    ExperimentOptions own = options;
    const std::initializer_list<
        std::pair<const char*, std::optional<std::string> ExperimentOptions::*>>
        of_slots = {{"--instrument", &ExperimentOptions::instrument},
                    {"--serial", &ExperimentOptions::serial},
                    {"--model", &ExperimentOptions::model},
                    {"--axes", &ExperimentOptions::axes},
                    {"--unit", &ExperimentOptions::unit},
                    {"--range", &ExperimentOptions::range},
                    {"--convention", &ExperimentOptions::convention},
                    {"--field", &ExperimentOptions::field},
                    {"--field-unit", &ExperimentOptions::field_unit},
                    {"--field-magnitude", &ExperimentOptions::field_magnitude},
                    {"--field-magnitude-u", &ExperimentOptions::field_magnitude_u},
                    {"--field-table", &ExperimentOptions::field_table}};
    for (const auto& [option, member] : of_slots) {
      own.*member = of_slot(option, options.*member, slots, slot.slot);
    }
    if (!states_slots(options)) {
      own.instrument.reset();
    }
    try {
      set_instrument(own, slot.instrument);
      set_field(own, slot.instrument, experiment.table, slot.field);
      Experiment alone = experiment;
      alone.instrument = slot.instrument;
      alone.field = slot.field;
      static_cast<void>(make_field_description(alone));
    } catch (const UsageError& error) {
      throw UsageError(formatted("slot {}: {}", slot.slot, error.what()));
    } catch (const SetupError& error) {
      throw SetupError(formatted("slot {}: {}", slot.slot, error.what()), error.settings());
    }
  }
}

}  // namespace

bool states_slots(const ExperimentOptions& options) {
  return options.instrument && options.instrument->find('=') != std::string::npos &&
         !options.instrument->ends_with(".json");
}

Experiment make_experiment(const ExperimentOptions& options, const Experiment& base) {
  return make_experiment_file(options, base).experiment;
}

ExperimentFile make_experiment_file(const ExperimentOptions& options, const Experiment& base) {
  ExperimentFile file{.experiment = base, .paths = {}};
  if (options.files.size() == 1 && is_experiment_file(options.files.front())) {
    file = read_experiment(options.files.front());
  } else if (!options.files.empty()) {
    file.paths.observations = options.files;
    for (const std::string& path : options.files) {
      if (is_experiment_file(path)) {
        throw UsageError(formatted("'{}' is an experiment file; give no other file with it", path));
      }
    }
  }
  Experiment& experiment = file.experiment;
  set_place(options, experiment.table);
  const bool of_slots = states_slots(options) || !experiment.slots.empty();
  if (!of_slots) {
    set_instrument(options, experiment.instrument);
    set_field(options, experiment.instrument, experiment.table, experiment.field);
  }
  if (options.face_names) {
    try {
      experiment.face_names = parse_face_names(*options.face_names);
    } catch (const DomainError& error) {
      throw UsageError("--face-names", error);
    }
  }
  if (options.also) {
    experiment.also.clear();
    for (const std::string_view kind : split(*options.also, ',')) {
      set_models(options, experiment.also.emplace_back(make_field(kind)));
    }
  }
  if (options.fence_azimuth) {
    experiment.table.fence_azimuth_rad =
        number_of("--fence-azimuth", *options.fence_azimuth) * rad_per_deg;
  }
  if (options.slope) {
    experiment.table.slope = slope_of_option(*options.slope);
  }
  if (options.nominal_sensitivity) {
    experiment.nominal_sensitivity =
        number_of("--nominal-sensitivity", *options.nominal_sensitivity);
    if (*experiment.nominal_sensitivity == 0.0) {
      throw UsageError("--nominal-sensitivity: must not be 0");
    }
  }
  if (options.positioner) {
    experiment.positioner = read_positioner(*options.positioner);
  }
  if (options.positioner_u) {
    experiment.positioner = experiment.positioner.with_normal_u(
        parse_nonnegative("--positioner-u", *options.positioner_u));
  }
  experiment.slot = options.slot.value_or(experiment.slot);
  set_method(options, experiment);
  set_temperature(options, experiment);
  set_stated_uncertainties(options, experiment.stated);
  if (of_slots) {
    set_slots(options, experiment);
  } else {
    // Makes the field description before the readings are read, only to report errors early. If the
    // readings may state field vectors, this check assumes that the magnitude is known.
    const bool may_bring =
        !file.paths.observations.empty() &&
        method_kind(experiment.fit.method.value_or(Method::known)).directions_known;
    static_cast<void>(make_field_description(experiment, std::nullopt,
                                             may_bring ? std::optional(1.0) : std::nullopt));
  }
  return file;
}

namespace {

// Returns the field that was stated for a record, with start values for a new calibration. A part
// of known magnitude starts with its direction in the record. A part of unknown magnitude stays
// unknown, because its magnitude may have changed, for example that of the light in a room.
FieldSetup parts_as_stated(FieldSetup stated, const FieldDescription& found) {
  const auto start = [](FieldSetup& part, const FieldDescription& known) {
    if (!part.in_table && part.magnitude) {
      part.in_table = known.in_table;
    }
  };
  if (stated.others.size() + 1 == found.parts.size()) {
    start(stated, found.parts.front());
    for (std::size_t p = 0; p < stated.others.size(); ++p) {
      start(stated.others[p], found.parts[p + 1]);
    }
  }
  return stated;
}

}  // namespace

Experiment experiment_of(const Calibration& record) {
  Experiment experiment;
  FieldSetup stated;
  if (!record.provenance.experiment.empty()) {
    const Experiment done =
        parse_experiment(record.provenance.experiment, "the record's experiment").experiment;
    experiment.fit.noise_ratio = done.fit.noise_ratio;
    experiment.fit.drift = done.fit.drift;
    experiment.fit.seats = done.fit.seats;
    experiment.face_names = done.face_names;
    experiment.nominal_sensitivity = done.nominal_sensitivity;
    experiment.table.fence_azimuth_rad = done.table.fence_azimuth_rad;
    stated = done.field;
  }
  experiment.instrument = record.sensor.instrument;
  if (!method_kind(record.fit.method).by_turns) {
    experiment.fit.method = record.fit.method;
  }
  const FieldDescription& field = record.sensor.field;
  const bool given = method_kind(experiment.fit.method).directions_known;
  experiment.field = stated.others.empty()
                         ? setup_of(field, given || !field_kind(field.kind).vertical)
                         : parts_as_stated(std::move(stated), field);
  experiment.table.site = field.site;
  experiment.table.date = field.date;
  for (const AlsoResponse& also : record.sensor.also) {
    FieldSetup& part = experiment.also.emplace_back(make_field(also.kind));
    part.unit = also.unit;
    part.in_table = also.in_table;
  }
  if (record.fit.weights != Weighting::none) {
    experiment.fit.weighting = record.fit.weights;
  }
  experiment.fit.robust = record.fit.robust;
  experiment.fit.level_by = record.fit.level_by_block ? LevelBy::block : LevelBy::run;
  experiment.fit.shape = record.fit.shape.value_or(experiment.fit.shape);
  experiment.slot = record.provenance.slot;
  return experiment;
}

}  // namespace axiscal::cli
