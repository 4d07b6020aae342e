// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/experiment_json.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <utility>

#include <Eigen/LU>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/instrument_kind.hpp"
#include "axiscal/positioner/positioner_json.hpp"
#include "calib/record/src/setup_members.hpp"
#include "core/formatted.hpp"
#include "core/json_members.hpp"
#include "field/field_json.hpp"

namespace axiscal {
namespace {

constexpr std::array<std::string_view, 31> keys_of_experiment = {"format",
                                                                 "version",
                                                                 "observations",
                                                                 "instrument",
                                                                 "field",
                                                                 "also",
                                                                 "site",
                                                                 "table",
                                                                 "positioner",
                                                                 "slot",
                                                                 "method",
                                                                 "weights",
                                                                 "robust",
                                                                 "squares",
                                                                 "noise_ratio",
                                                                 "leave_out",
                                                                 "level_by",
                                                                 "drift",
                                                                 "seats",
                                                                 "shape",
                                                                 "temperature",
                                                                 "uncertainty",
                                                                 "limits",
                                                                 "from",
                                                                 "nominal_sensitivity",
                                                                 "polar_fit",
                                                                 "mistakes",
                                                                 "process",
                                                                 "rotation_sensor_from_positioner",
                                                                 "slots",
                                                                 "face_names"};

// Reads or writes the members of an experiment file.
class ExperimentMembers {
 public:
  ExperimentMembers(JsonMembers& io, ExperimentFile& file, std::string path)
      : io_(io), e_(file.experiment), paths_(file.paths), path_(std::move(path)) {}

  void all() {
    io_.allow_keys(keys_of_experiment);
    observations();
    instrument();
    field_member(io_, "field", e_.field);
    slots();
    face_names();
    second_fields_member(io_, "also", e_.also);
    site();
    table();
    positioner();
    io_.value_if_any("slot", e_.slot);
    rotation();
    choices();
    io_.value_if_any("nominal_sensitivity", e_.nominal_sensitivity);
    noise_ratio();
    io_.value_if_any("leave_out", e_.leave_out);
    temperature();
    uncertainty();
    process();
    from();
    limits();
  }

 private:
  [[nodiscard]] std::string resolved(const std::string& name) const {
    const std::filesystem::path path(name);
    if (path.is_absolute() || name == "-") {
      return name;
    }
    return (std::filesystem::path(path_).parent_path() / path).string();
  }

  void observations() {
    if (!io_.reads()) {
      io_.value_if_any("observations", paths_.observations);
    } else if (const auto files = io_.from().find("observations")) {
      const std::vector<std::string> names =
          files->is_array() ? files->texts() : std::vector<std::string>{files->text()};
      for (const std::string& name : names) {
        paths_.observations.push_back(resolved(name));
      }
    }
  }

  static void instrument_member(JsonMembers& io, Instrument& now) {
    io.object("instrument", !now.kind.empty() || now.axes != Instrument().axes,
              [&](JsonMembers& one) {
                static constexpr std::array<std::string_view, 8> keys = {
                    "kind", "serial", "model", "axes", "unit", "convention", "range", "one_sided"};
                one.allow_keys(keys);
                stated_members(one, now);
              });
  }

  void instrument() { instrument_member(io_, e_.instrument); }

  // Reads or writes an object with one member for each slot. Missing members of a slot's instrument
  // or field get their default values.
  void slots() {
    io_.object("slots", !e_.slots.empty(), [&](JsonMembers& all) {
      if (all.reads()) {
        for (const std::string& name : all.from().keys()) {
          e_.slots.push_back({.slot = name, .instrument = {}, .field = {}});
        }
      }
      for (SlotSetup& slot : e_.slots) {
        all.need_object(slot.slot.c_str(), [&](JsonMembers& one) {
          static constexpr std::array<std::string_view, 2> keys = {"instrument", "field"};
          one.allow_keys(keys);
          instrument_member(one, slot.instrument);
          field_member(one, "field", slot.field);
        });
      }
    });
  }

  void face_names() {
    io_.object("face_names", !e_.face_names.empty(), [&](JsonMembers& all) {
      if (!all.reads()) {
        for (const auto& [word, face] : e_.face_names) {
          all.put(word.c_str(), face_name(face));
        }
        return;
      }
      for (const std::string& word : all.from().keys()) {
        all.check(word.c_str(), [&] {
          e_.face_names.merge(parse_face_names(word + "=" + all.from().at(word).text()));
        });
      }
    });
  }

  void site() {
    TablePlace& place = e_.table;
    io_.object("site", place.site || !place.date.empty(), [&](JsonMembers& one) {
      static constexpr std::array<std::string_view, 4> keys = {"latitude_deg", "longitude_deg",
                                                               "height_m", "date"};
      one.allow_keys(keys);
      date(one);
      const bool has_site = one.reads() ? one.from().find("latitude_deg") ||
                                              one.from().find("longitude_deg") ||
                                              one.from().find("height_m")
                                        : place.site.has_value();
      if (!has_site) {
        return;
      }
      Site site = place.site.value_or(Site{});
      one.need("latitude_deg", site.latitude_deg);
      if (one.has("longitude_deg", place.has_longitude)) {
        one.need("longitude_deg", site.longitude_deg);
      } else {
        place.has_longitude = false;
      }
      one.value_if_any("height_m", site.height_m);
      if (one.reads()) {
        io_.check("site", [&] { check_site(site); });
      }
      place.site = site;
    });
  }

  void date(JsonMembers& one) {
    if (!one.reads()) {
      one.value_if_any("date", e_.table.date);
    } else if (const auto date = one.from().find("date")) {
      e_.table.date = date->is_text() ? date->text() : number_text(date->number());
      if (!parse_date(e_.table.date)) {
        date->fail("must be a date in ISO 8601 or a decimal year");
      }
    }
  }

  void table() {
    TablePlace& place = e_.table;
    const bool sloping = !place.slope.isZero(0.0);
    io_.object("table", place.fence_azimuth_rad || sloping, [&](JsonMembers& one) {
      static constexpr std::array<std::string_view, 2> keys = {"fence_azimuth_deg", "slope"};
      one.allow_keys(keys);
      if (one.has("fence_azimuth_deg", place.fence_azimuth_rad.has_value())) {
        double azimuth_deg = place.fence_azimuth_rad.value_or(0.0) * deg_per_rad;
        one.need("fence_azimuth_deg", azimuth_deg);
        place.fence_azimuth_rad = azimuth_deg * rad_per_deg;
      }
      if (one.has("slope", sloping)) {
        one.need_vector("slope", place.slope, 2);
        one.check("slope", place.slope.norm() < 1.0, "X^2 + Y^2 must be less than 1");
      }
    });
  }

  // Reads or writes the positioner: the path of a positioner file, or an object.
  void positioner() {
    if (!io_.reads()) {
      if (!e_.positioner.is_nominal() || !e_.positioner.id().empty() ||
          !e_.positioner.mounts().empty() || e_.positioner.description().normal_covariance) {
        io_.put("positioner", Json::parse(positioner_json(e_.positioner)));
      }
    } else if (const auto value = io_.from().find("positioner")) {
      e_.positioner = value->is_text() ? read_positioner(resolved(value->text()))
                                       : parse_positioner(value->dump(), value->path());
    }
  }

  void rotation() {
    Eigen::Matrix3d& rotation = e_.rotation_sensor_from_positioner;
    if (io_.has("rotation_sensor_from_positioner", !rotation.isIdentity(0.0))) {
      io_.need_matrix("rotation_sensor_from_positioner", rotation, 3, 3);
      constexpr double square = 1e-9;
      io_.check(
          "rotation_sensor_from_positioner",
          (rotation * rotation.transpose()).isIdentity(square) && rotation.determinant() > 0.0,
          "must be a rotation");
    }
  }

  void choices() {
    const Experiment usual;
    io_.choice_unless("shape", e_.fit.shape, usual.fit.shape, shape_name, parse_shape,
                      "symmetric, triangular");
    io_.flag_unless("squares", e_.fit.squares, false);
    io_.choice_if_any("method", e_.fit.method, method_name, parse_chosen_method,
                      "paired, joint, known, magnitude, bias");
    io_.choice_if_any(
        "weights", e_.fit.weighting,
        [](std::optional<Weighting> w) { return w ? weighting_name(*w) : std::string_view(); },
        parse_weighting, "samples, sd, none");
    robust();
    io_.choice_unless("drift", e_.fit.drift, usual.fit.drift, drift_name, parse_drift,
                      "auto, none, linear");
    io_.choice_unless("seats", e_.fit.seats, usual.fit.seats, seats_name, parse_seats,
                      "auto, fit, none");
    io_.choice_unless("level_by", e_.fit.level_by, usual.fit.level_by, level_by_name,
                      parse_level_by, "run, block");
    io_.flag_unless("polar_fit", e_.fit.compare_polar_fit, false);
    io_.flag_unless("mistakes", e_.fit.search_for_mistakes, true);
  }

  void robust() {
    if (!io_.reads()) {
      io_.flag_unless("robust", e_.fit.robust, false);
    } else if (const auto value = io_.from().find("robust")) {
      e_.fit.robust = value->is_text() ? true : value->boolean();
      if (value->is_text() && value->text() != "bisquare") {
        value->fail("must be true, false or \"bisquare\"");
      }
    }
  }

  void noise_ratio() {
    if (!io_.reads()) {
      if (e_.fit.noise_ratio.size() > 0) {
        io_.put("noise_ratio", e_.fit.noise_ratio);
      }
    } else if (const auto ratio = io_.from().find("noise_ratio")) {
      e_.fit.noise_ratio = ratio->vector(static_cast<Eigen::Index>(ratio->elements().size()));
    }
  }

  void temperature() {
    TemperatureSetup& setup = e_.fit.temperature;
    const bool stated = setup.order > 0 || setup.automatic || setup.ignored || setup.reference;
    io_.object("temperature", stated, [&](JsonMembers& one) {
      static constexpr std::array<std::string_view, 2> keys = {"order", "reference"};
      one.allow_keys(keys);
      if (!one.reads()) {
        if (setup.automatic) {
          one.put("order", "auto");
        } else if (setup.order > 0 || setup.ignored) {
          one.put("order", setup.order);
        }
      } else if (const auto order = one.from().find("order")) {
        setup.automatic = order->is_text() && order->text() == "auto";
        if (!setup.automatic && (order->is_text() || order->integer() < 0)) {
          order->fail("must be 0, 1, 2 or \"auto\"");
        }
        setup.order = setup.automatic ? 0 : order->integer();
        setup.ignored = !setup.automatic && setup.order == 0;
      }
      one.value_if_any("reference", setup.reference);
    });
  }

  void uncertainty() {
    StatedUncertainties& stated = e_.stated;
    const std::array<std::pair<const char*, double*>, 5> all = {
        {{"resolution", &stated.resolution},
         {"slope_rad", &stated.slope_u},
         {"direction_rad", &stated.direction_u_rad},
         {"temperature", &stated.temperature_u},
         {"reference", &stated.reference_u}}};
    bool any = false;
    for (const auto& [key, value] : all) {
      any = any || *value > 0.0;
    }
    io_.object("uncertainty", any, [&](JsonMembers& one) {
      static constexpr std::array<std::string_view, 5> keys = {
          "resolution", "slope_rad", "direction_rad", "temperature", "reference"};
      one.allow_keys(keys);
      for (const auto& [key, value] : all) {
        one.value_if_any(key, *value);
        if (!(*value >= 0.0)) {
          one.check(key, false, "must not be negative");
        }
      }
    });
  }

  void process() {
    io_.object_if_any("process", e_.fit.process, [](JsonMembers& one, ProcessScatter& process) {
      const auto m = one.reads()
                         ? static_cast<Eigen::Index>(one.from().at("mean_square").elements().size())
                         : process.mean_square.size();
      one.need_vector("mean_square", process.mean_square, m);
      one.need("degrees_of_freedom", process.degrees_of_freedom);
      one.need("records", process.records);
    });
  }

  // Reads or writes the record `from`: the path of a record file, or an object.
  void from() {
    if (!io_.reads()) {
      if (e_.from) {
        io_.put("from", Json::parse(calibration_json(*e_.from)));
      }
    } else if (const auto value = io_.from().find("from")) {
      e_.from = std::make_shared<const Calibration>(
          value->is_text() ? read_calibration(resolved(value->text()))
                           : parse_calibration(value->dump(), value->path()));
    }
  }

  void limits() {
    io_.value_if_any("limits", paths_.limits);
    if (io_.reads() && !paths_.limits.empty()) {
      paths_.limits = resolved(paths_.limits);
    }
  }

  JsonMembers& io_;
  Experiment& e_;
  ExperimentPaths& paths_;
  std::string path_;
};

}  // namespace

ExperimentFile parse_experiment(std::string_view text, const std::string& path) {
  const JsonValue json = parse_json(text, path);
  json.require_format("axiscal-experiment");
  ExperimentFile file;
  JsonMembers io(json);
  ExperimentMembers(io, file, path).all();
  set_default_field(file.experiment);
  return file;
}

ExperimentFile read_experiment(const std::string& path) {
  return parse_experiment(read_whole_file(path), path);
}

bool can_be_stated(const Experiment& experiment) {
  const auto field_can = [](const FieldSetup& field) {
    const std::vector<const FieldSetup*> parts = field.parts();
    return std::all_of(parts.begin(), parts.end(), [](const FieldSetup* part) {
      return field_kind(part->kind()).make != nullptr;
    });
  };
  return field_can(experiment.field) &&
         std::all_of(experiment.also.begin(), experiment.also.end(), field_can);
}

std::string experiment_json(const Experiment& experiment, const ExperimentPaths& paths) {
  JsonWriter writer;
  writer.begin_object();
  JsonMembers io(writer);
  io.put("format", "axiscal-experiment");
  io.put("version", 1);
  ExperimentFile file{.experiment = experiment, .paths = paths};
  ExperimentMembers(io, file, "").all();
  writer.end_object();
  return writer.finish();
}

}  // namespace axiscal
